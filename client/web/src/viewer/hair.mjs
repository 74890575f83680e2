/* Strands as ribbons: one buffer of points, read four times with an offset, so that an edit uploads
 * each point once. */
import * as THREE from 'three';
import vertexShader from './hair.vert.glsl';
import fragmentShader from './hair.frag.glsl';

const CORNERS = new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]);

export class Hair extends THREE.Mesh {
    constructor(color = [0.20, 0.105, 0.05]) {
        const material = new THREE.RawShaderMaterial({
            glslVersion: THREE.GLSL3, vertexShader, fragmentShader, side: THREE.DoubleSide,
            uniforms: {
                vertices: { value: 2 }, width: { value: 1e-4 }, pixel: { value: 1e-3 }, lit: { value: false },
                color: { value: new THREE.Vector3(...color) },
                keyDirection: { value: new THREE.Vector3(0, 1, 0) }, rimDirection: { value: new THREE.Vector3(0, 1, 0) },
                light: { value: null }, lightOrigin: { value: new THREE.Vector3() }, lightSize: { value: new THREE.Vector3(1, 1, 1) },
            },
        });
        super(new THREE.InstancedBufferGeometry(), material);
        this.frustumCulled = false;
    }

    /* points: [3 + count * vertices * 3 + 6], one vertex of room before and two behind */
    show({ points, count, vertices }) {
        if (this.buffer?.array.length === points.length) {
            this.buffer.array = points;
            this.buffer.needsUpdate = true;
        } else this.#allocate(points);
        this.geometry.instanceCount = count * vertices;
        Object.assign(this, { count, vertices });
        this.material.uniforms.vertices.value = vertices;
        this.visible = true;
    }

    #allocate(points) {
        this.geometry.dispose();
        this.geometry = new THREE.InstancedBufferGeometry();
        this.geometry.setIndex([0, 1, 2, 2, 1, 3]);
        this.geometry.setAttribute('corner', new THREE.BufferAttribute(CORNERS, 2));
        this.buffer = new THREE.InstancedInterleavedBuffer(points, 3).setUsage(THREE.DynamicDrawUsage);
        ['before', 'p', 'q', 'after'].forEach((name, i) =>
            this.geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(this.buffer, 3, 3 * i)));
    }

    /* A full head has about 100 000 hairs of 0.08 mm; fewer strands are drawn wider, each for several. */
    static widthOf(diagonal, count) {
        return Math.min(0.00022 * diagonal * Math.sqrt(Math.max(1, 60000 / count)), diagonal / 150);
    }

    shine({ size, origin, cell, data }) {
        const { uniforms } = this.material;
        uniforms.light.value?.dispose();
        const texture = new THREE.Data3DTexture(data, ...size);
        Object.assign(texture, { format: THREE.RGFormat, minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, unpackAlignment: 1, needsUpdate: true });
        uniforms.light.value = texture;
        uniforms.lightOrigin.value.set(...origin);
        uniforms.lightSize.value.set(...size.map((n) => n * cell));
        uniforms.lit.value = true;
    }

    dispose() {
        this.geometry.dispose();
        this.material.uniforms.light.value?.dispose();
        this.material.dispose();
    }
}

/* The box of the points that a Hair shows. */
export function boxOf({ points, count, vertices }) {
    const box = new THREE.Box3(), at = new THREE.Vector3();
    for (let i = 3, end = 3 + 3 * count * vertices; i < end; i += 9) box.expandByPoint(at.fromArray(points, i));
    return box;
}
