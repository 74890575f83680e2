/* Strands as ribbons: one buffer of points, read four times with an offset, so that an edit uploads
 * each point once. Strands stand in a fair order: fewer of them, from the first on, look like all. */
import * as THREE from 'three';
import vertexShader from './hair.vert.glsl';
import fragmentShader from './hair.frag.glsl';

const CORNERS = new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]);

const texture = (data) => Object.assign(new THREE.DataTexture(data, 256, 1), { minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, needsUpdate: true });

export class Hair extends THREE.Mesh {
    constructor(color = [0.20, 0.105, 0.05]) {
        const material = new THREE.RawShaderMaterial({
            glslVersion: THREE.GLSL3, vertexShader, fragmentShader, side: THREE.DoubleSide,
            uniforms: {
                vertices: { value: 2 }, width: { value: 1e-4 }, pixel: { value: 1e-3 }, lit: { value: false },
                color: { value: new THREE.Vector3(...color) },
                keyDirection: { value: new THREE.Vector3(0, 1, 0) }, rimDirection: { value: new THREE.Vector3(0, 1, 0) },
                light: { value: null }, lightOrigin: { value: new THREE.Vector3() }, lightSize: { value: new THREE.Vector3(1, 1, 1) },
                coloured: { value: false }, palette: { value: texture(new Uint8Array(1024)) }, range: { value: new THREE.Vector2(0, 1) },
            },
        });
        super(new THREE.InstancedBufferGeometry(), material);
        this.frustumCulled = false;
        this.count = 0;
        this.drawn = Infinity;
    }

    /* points: [3 + count * vertices * 3 + 6], one vertex of room before and two behind */
    show({ points, count, vertices, evaluated = count }) {
        const { uniforms } = this.material;
        if (this.buffer?.array.length === points.length) {
            this.buffer.array = points;
            this.buffer.needsUpdate = true;
        } else this.#allocate(points, count * vertices);
        if (this.vertices !== vertices || this.count !== count) uniforms.coloured.value = false;
        Object.assign(this, { count, vertices, evaluated });
        uniforms.vertices.value = vertices;
        this.visible = true;
    }

    #allocate(points, n) {
        this.geometry.dispose();
        this.geometry = new THREE.InstancedBufferGeometry();
        this.geometry.setIndex([0, 1, 2, 2, 1, 3]);
        this.geometry.setAttribute('corner', new THREE.BufferAttribute(CORNERS, 2));
        this.buffer = new THREE.InstancedInterleavedBuffer(points, 3).setUsage(THREE.DynamicDrawUsage);
        ['before', 'p', 'q', 'after'].forEach((name, i) =>
            this.geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(this.buffer, 3, 3 * i)));
        this.values = null;
        this.n = n;
    }

    /* Coloured by `values` [count * vertices] along a palette, or as hair again. */
    colour(by) {
        const { uniforms } = this.material;
        uniforms.coloured.value = Boolean(by);
        if (!by) return;
        const array = new Float32Array(this.n + 1);
        array.set(by.values);
        this.values = new THREE.InstancedInterleavedBuffer(array, 1);
        ['value_p', 'value_q'].forEach((name, i) =>
            this.geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(this.values, 1, i)));
        uniforms.palette.value.dispose();
        uniforms.palette.value = texture(by.palette);
        uniforms.range.value.set(...by.range);
    }

    /* How many strands are drawn, each as wide as stands for the rest. */
    draw(most, diagonal) {
        this.drawn = Math.max(1, Math.min(this.evaluated, most));
        this.geometry.instanceCount = this.drawn * this.vertices;
        this.material.uniforms.width.value = Hair.widthOf(diagonal, this.drawn);
    }

    /* A full head has about 100 000 hairs of 0.08 mm; fewer strands are drawn wider, each for several. */
    static widthOf(diagonal, count) {
        return Math.min(0.00022 * diagonal * Math.sqrt(Math.max(1, 60000 / count)), diagonal / 150);
    }

    shine({ size, origin, cell, data }) {
        const { uniforms } = this.material;
        uniforms.light.value?.dispose();
        const grid = new THREE.Data3DTexture(data, ...size);
        Object.assign(grid, { format: THREE.RGFormat, minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, unpackAlignment: 1, needsUpdate: true });
        uniforms.light.value = grid;
        uniforms.lightOrigin.value.set(...origin);
        uniforms.lightSize.value.set(...size.map((n) => n * cell));
        uniforms.lit.value = true;
    }

    dispose() {
        this.geometry.dispose();
        this.material.uniforms.light.value?.dispose();
        this.material.uniforms.palette.value.dispose();
        this.material.dispose();
    }
}

/* The box of the points that a Hair shows. */
export function boxOf({ points, count, vertices }) {
    const box = new THREE.Box3(), at = new THREE.Vector3();
    for (let i = 3, end = 3 + 3 * count * vertices; i < end; i += 9) box.expandByPoint(at.fromArray(points, i));
    return box;
}
