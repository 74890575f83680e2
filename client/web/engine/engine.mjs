/* The page's groom: a groom document (arrays inline) held by the WebAssembly engine, edited in place
 * and evaluated to strands at the server's own numbers. Runs in a page, in a worker and in Node. */

const ARRAYS = [
    ['strands', 'roots'], ['strands', 'root_uv'], ['guides', 'points'], ['guides', 'root_uv'],
    ['instancing', 'guide'], ['instancing', 'weight'], ['operator_guides', 'guide'], ['operator_guides', 'of_strand'],
];

/* Of an array of a document: { dtype, shape, data }. */
export function bytesOf(array) {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(array.data);
    const text = atob(array.data);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return bytes;
}

/* Seeds are whole numbers below 2^53 in documents, 64 bits in the engine. */
const high = (seed) => Math.floor(seed / 4294967296) >>> 0;
const low = (seed) => seed % 4294967296 >>> 0;

export class Engine {
    /* wasm: bytes, or a promise of a Response */
    static async load(wasm) {
        /* wasi-libc wants these for stdio, which the engine never uses */
        const refuse = () => 8;
        const imports = { wasi_snapshot_preview1: new Proxy({}, { get: () => refuse }) };
        const { instance } = wasm instanceof Promise ? await WebAssembly.instantiateStreaming(wasm, imports)
                                                      : await WebAssembly.instantiate(wasm, imports);
        instance.exports._initialize?.();
        return new Engine(instance.exports);
    }

    constructor(exports) {
        this.exports = exports;
        this.types = this.#readTypes();
    }

    get memory() { return this.exports.memory.buffer; }

    text(address) {
        const bytes = new Uint8Array(this.memory, address);
        return address ? new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0))) : null;
    }

    /* Operator types with their parameters: name, unit, range, help, as libgroom has them. */
    #readTypes() {
        const types = [];
        for (let type = 0, name; (name = this.text(this.exports.engine_type_name(type))) !== null; type++) {
            const parameters = [];
            for (let i = 0; i < this.exports.engine_n_parameters(type); i++) parameters.push(this.#readParameter(type, i));
            const random = [];
            for (let i = 0; i < this.exports.engine_n_random(type); i++)
                random.push(this.text(this.exports.engine_random_name(type, i)));
            types.push({ type, name, parameters, random });
        }
        return types;
    }

    /* struct groom_operator_parameter: two addresses, four floats, one address */
    #readParameter(type, index) {
        const view = new DataView(this.memory, this.exports.engine_parameter(type, index), 28);
        const float = (i) => view.getFloat32(8 + 4 * i, true);
        return {
            name: this.text(view.getUint32(0, true)), unit: this.text(view.getUint32(4, true)),
            minimum: float(0), maximum: float(1), slider_maximum: float(2), initial: float(3),
            help: this.text(view.getUint32(24, true)),
        };
    }

    typeOf(name) {
        const type = this.types.find((t) => t.name === name);
        if (!type) throw new Error(`operator "${name}" is not known to the engine`);
        return type;
    }

    check(status) {
        if (status === 0) return;
        const error = new Error(this.text(this.exports.engine_message()));
        error.pointer = this.text(this.exports.engine_pointer());
        throw error;
    }

    copyIn(bytes, address) { new Uint8Array(this.memory, address, bytes.length).set(bytes); }

    /* Which strands of n are shown, and exported, where `count` of them are, in the fair order. */
    fair(n, count) {
        const address = this.exports.engine_allocate(4 * count);
        try {
            this.check(this.exports.engine_fair(n, count, address));
            return new Uint32Array(this.memory, address, count).slice();
        } finally { this.exports.engine_release(address); }
    }

    /* Shadows within strands at an address: { size, origin, cell, data }, data as bytes of [cell][2]: how
     * much of the key light arrives, how much of the surroundings is seen. */
    light(points, count, vertices, { cells, width, key }) {
        const address = this.exports.engine_light(points, count, vertices, cells, width, ...key);
        if (!address) throw new Error(this.text(this.exports.engine_message()));
        const head = new DataView(this.memory, address, 36), float = (at) => head.getFloat32(at, true);
        const size = [0, 4, 8].map((at) => head.getUint32(at, true)), n = size[0] * size[1] * size[2];
        const depth = new Float32Array(this.memory, head.getUint32(28, true), n);
        const ambient = new Float32Array(this.memory, head.getUint32(32, true), n), data = new Uint8Array(2 * n);
        for (let i = 0; i < n; i++) {
            data[2 * i] = 255 * Math.exp(-depth[i]);
            data[2 * i + 1] = 255 * Math.min(1, ambient[i]);
        }
        const grid = { size, origin: [float(12), float(16), float(20)], cell: float(24), data };
        this.exports.engine_light_destroy(address);
        return grid;
    }

    /* The same of points that are not in the engine: Float32Array [count * vertices * 3]. */
    lightOf(points, count, vertices, options) {
        const address = this.exports.engine_allocate(points.byteLength);
        if (!address) throw new Error(`no memory for ${count} strands`);
        try {
            new Float32Array(this.memory, address, points.length).set(points);
            return this.light(address, count, vertices, options);
        } finally { this.exports.engine_release(address); }
    }
}

export class Groom {
    constructor(engine, address, count, vertices) {
        if (!address) throw new Error(engine.text(engine.exports.engine_message()));
        Object.assign(this, { engine, address, count, vertices });
    }

    static fromDocument(engine, document) {
        const { count, vertices } = document.strands;
        const groom = new Groom(engine, engine.exports.engine_groom(count, vertices, document.guides.count,
            document.operator_guides.guide.shape[0], document.instancing.guide.shape[1]), count, vertices);
        ARRAYS.forEach(([part, name], which) =>
            engine.copyIn(bytesOf(document[part][name]), engine.exports.engine_array(groom.address, which)));
        if (document.axes)
            new Float32Array(engine.memory, engine.exports.engine_axes(groom.address), 9).set(document.axes.flat());
        document.operators.forEach((operator, i) => groom.insert(i, operator));
        engine.check(engine.exports.engine_validate(groom.address));
        return groom;
    }

    /* The first strands of the fair order, in that order, as a groom of their own: each evaluates as in the whole. */
    select(count) {
        return new Groom(this.engine, this.engine.exports.engine_select(this.address, count), count, this.vertices);
    }

    destroy() {
        this.engine.exports.engine_release(this.points ?? 0);
        this.engine.exports.engine_destroy(this.address);
    }

    /* An operator as a document has it; what it leaves out is supplied as the server does. */
    insert(index, operator) {
        const { engine, address } = this, { exports } = engine, type = engine.typeOf(operator.type);
        const seed = operator.seed ?? 1;
        engine.check(exports.engine_insert(address, index, type.type, high(seed), low(seed)));
        if (operator.id !== undefined) {
            exports.engine_identify(address, index, operator.id, high(seed), low(seed), operator.enabled === false ? 0 : 1);
            exports.engine_draw(address, index, high(seed), low(seed));
        }
        type.random.forEach((name, which) => {
            if (operator.random?.[name]) engine.copyIn(bytesOf(operator.random[name]), exports.engine_random(address, index, which));
        });
        for (const parameter of type.parameters)
            if (operator[parameter.name] !== undefined) this.set(index, type, parameter.name, operator[parameter.name]);
    }

    set(index, type, name, value) {
        const slot = type.parameters.findIndex((p) => p.name === name);
        new Float32Array(this.engine.memory, this.engine.exports.engine_parameters(this.address, index), 4)[slot] = value;
    }

    enable(index, operator) {
        const seed = operator.seed ?? 1;
        this.engine.exports.engine_identify(this.address, index, operator.id, high(seed), low(seed), operator.enabled === false ? 0 : 1);
    }

    /* Vertices of a guide: Float32Array [vertices * 3]. */
    moveGuide(guide, points) {
        const guides = this.engine.exports.engine_array(this.address, 2);
        new Float32Array(this.engine.memory, guides + 12 * guide * this.vertices, points.length).set(points);
    }

    remove(index) { this.engine.check(this.engine.exports.engine_remove(this.address, index)); }
    move(from, to) { this.engine.check(this.engine.exports.engine_move(this.address, from, to)); }

    /* Strands first..first+count-1 as one Float32Array [count * vertices * 3], valid until the next call. */
    evaluate(first = 0, count = this.count) {
        const { exports } = this.engine, n = count * this.vertices * 3;
        if (!this.points || this.room < n) {
            exports.engine_release(this.points ?? 0);
            this.points = exports.engine_allocate(4 * n);
            this.room = n;
            if (!this.points) throw new Error(`no memory for ${count} strands`);
        }
        this.engine.check(exports.engine_evaluate(this.address, first, count, this.points));
        this.shown = count;
        return new Float32Array(this.engine.memory, this.points, n);
    }

    /* Engine.light within the strands of the last evaluation. */
    light(options) { return this.engine.light(this.points, this.shown, this.vertices, options); }
}
