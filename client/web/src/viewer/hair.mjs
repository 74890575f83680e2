/* Strands as ribbons whose points stand in a texture: an edit uploads each point once. Strands stand in a fair
 * order: fewer of them, from the first on, look like all. */
import * as THREE from 'three';
import vertexShader from './hair.vert.glsl';
import fragmentShader from './hair.frag.glsl';

const palette = (data) => Object.assign(new THREE.DataTexture(data, 256, 1), { minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, needsUpdate: true });

/* Rows of `width` numbers that hold at least `n`. */
function numbers(n, width) {
    const rows = Math.max(1, Math.ceil(n / width)), made = new THREE.DataTexture(new Float32Array(rows * width), width, rows, THREE.RedFormat, THREE.FloatType);
    made.needsUpdate = true;
    return made;
}

/* Vertices in a row of the textures, three numbers each: what every WebGL 2 takes, and the daemon's largest groom
 * fills no more rows than that. */
export const ROW = 1365;

/* Two triangles a segment, strand after strand. */
function ribbons(count, vertices) {
    const index = new Uint32Array(6 * count * (vertices - 1));
    for (let strand = 0, at = 0; strand < count; strand++)
        for (let j = 0, v = 2 * strand * vertices; j + 1 < vertices; j++, v += 2) {
            index[at++] = v;
            index[at++] = v + 1;
            index[at++] = v + 2;
            index[at++] = v + 2;
            index[at++] = v + 1;
            index[at++] = v + 3;
        }
    return index;
}

export class Hair extends THREE.Mesh {
    constructor(color = [0.20, 0.105, 0.05]) {
        const material = new THREE.RawShaderMaterial({
            glslVersion: THREE.GLSL3, vertexShader, fragmentShader, side: THREE.DoubleSide, defines: { ROW },
            uniforms: {
                points: { value: null }, values: { value: null },
                vertices: { value: 2 }, width: { value: 1e-4 }, pixel: { value: 1e-3 }, lit: { value: false },
                color: { value: new THREE.Vector3(...color) },
                keyDirection: { value: new THREE.Vector3(0, 1, 0) }, rimDirection: { value: new THREE.Vector3(0, 1, 0) },
                light: { value: null }, lightOrigin: { value: new THREE.Vector3() }, lightSize: { value: new THREE.Vector3(1, 1, 1) },
                coloured: { value: false }, palette: { value: palette(new Uint8Array(1024)) }, range: { value: new THREE.Vector2(0, 1) },
            },
        });
        super(new THREE.BufferGeometry(), material);
        this.frustumCulled = false;
        this.count = 0;
    }

    /* points: [3 + count * vertices * 3 + 6], of which those between the ends are looked at. */
    show({ points, count, vertices, evaluated = count }) {
        const { uniforms } = this.material, changed = this.vertices !== vertices || this.count !== count;
        if (changed) this.#allocate(count, vertices);
        Object.assign(this, { count, vertices, evaluated, held: points });
        uniforms.points.value.image.data.set(points.subarray(3, 3 + 3 * count * vertices));
        uniforms.points.value.needsUpdate = true;
        uniforms.vertices.value = vertices;
        this.visible = true;
    }

    #allocate(count, vertices) {
        const { uniforms } = this.material;
        uniforms.points.value?.dispose();
        uniforms.points.value = numbers(3 * count * vertices, 3 * ROW);
        uniforms.coloured.value = false;
        this.geometry.dispose();
        this.geometry = new THREE.BufferGeometry();
        this.geometry.setIndex(new THREE.BufferAttribute(ribbons(count, vertices), 1));
    }

    /* Coloured by `values` [count * vertices] along a palette, or as hair again. */
    colour(by) {
        const { uniforms } = this.material;
        uniforms.coloured.value = Boolean(by);
        if (!by) return;
        uniforms.values.value?.dispose();
        uniforms.values.value = numbers(by.values.length, ROW);
        uniforms.values.value.image.data.set(by.values);
        this.values = by.values;
        uniforms.palette.value.dispose();
        uniforms.palette.value = palette(by.palette);
        uniforms.range.value.set(...by.range);
    }

    /* How many strands are drawn, each as wide as stands for the rest. */
    draw(most, diagonal) {
        const drawn = Math.max(1, Math.min(this.evaluated, most));
        this.geometry.setDrawRange(0, 6 * drawn * (this.vertices - 1));
        this.material.uniforms.width.value = Hair.widthOf(diagonal, drawn);
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
        for (const name of ['light', 'palette', 'points', 'values']) this.material.uniforms[name].value?.dispose();
        this.material.dispose();
    }
}

/* The box of the points that a Hair shows. */
export function boxOf({ points, count, vertices }) {
    const box = new THREE.Box3(), at = new THREE.Vector3();
    for (let i = 3, end = 3 + 3 * count * vertices; i < end; i += 9) box.expandByPoint(at.fromArray(points, i));
    return box;
}
