/* The picture: head, groom, target and guides under one camera. Draws when something has changed. */
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { Detail } from './detail.mjs';
import { Hair } from './hair.mjs';

const FIELD_OF_VIEW = 20, MARGIN = 1.12;
export const VIEWS = { front: [0, 0, 1], side: [1, 0, 0], back: [0, 0, -1], top: [0, 1, 0.001] };
export const COMPARISONS = ['groom', 'target', 'side by side', 'overlay', 'wipe'];

/* Skin that the hair throws its shadow on: the light that arrives among the strands, where that is known. */
function skin({ light, lightOrigin, lightSize, lit }) {
    const material = new THREE.MeshStandardMaterial({ color: 0xb98a74, roughness: 0.75, side: THREE.DoubleSide });
    material.onBeforeCompile = (shader) => {
        Object.assign(shader.uniforms, { light, lightOrigin, lightSize, lit });
        shader.vertexShader = shader.vertexShader.replace('void main() {', 'varying vec3 place;\nvoid main() {\nplace = position;');
        shader.fragmentShader = shader.fragmentShader
            .replace('void main() {', `precision highp sampler3D;
                uniform sampler3D light; uniform vec3 lightOrigin, lightSize; uniform bool lit; varying vec3 place;
                vec2 arriving() {
                    vec3 at = (place - lightOrigin) / lightSize, edge = smoothstep(0.0, 0.15, min(at, 1.0 - at));
                    return lit ? mix(vec2(1.0), texture(light, at).rg, edge.x * edge.y * edge.z) : vec2(1.0);
                }
                void main() {`)
            .replace('#include <lights_fragment_end>', `#include <lights_fragment_end>
                vec2 seen = arriving();
                reflectedLight.directDiffuse *= 0.25 + 0.75 * seen.r;
                reflectedLight.directSpecular *= seen.r;
                reflectedLight.indirectDiffuse *= 0.35 + 0.65 * seen.g;`);
    };
    return material;
}

/* Lines of a pinhole camera's pyramid, [..][3]: p = R x + t in its own axes (x right, y down, z forward). */
function frustumOf({ width, height, fx, fy, cx, cy, rotation, translation }, depth) {
    const toWorld = (p) => [0, 1, 2].map((c) => rotation.reduce((sum, row, k) => sum + row[c] * (p[k] - translation[k]), 0));
    const eye = toWorld([0, 0, 0]);
    const corners = [[0, 0], [width, 0], [width, height], [0, height]].map(([u, v]) => toWorld([((u - cx) / fx) * depth, ((v - cy) / fy) * depth, depth]));
    return corners.flatMap((corner, i) => [...eye, ...corner, ...corner, ...corners[(i + 1) % 4]]);
}

export class Viewer {
    constructor(parent) {
        this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
        this.canvas = this.renderer.domElement;
        this.canvas.tabIndex = 0;
        this.canvas.setAttribute('aria-label', 'The groom. Drag to turn, wheel to come closer, 1 to 4 for the views.');
        parent.append(this.canvas);
        this.renderer.autoClear = false;
        this.scene = new THREE.Scene();
        this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
        this.controls = new OrbitControls(this.camera, this.canvas);
        this.detail = new Detail(this.renderer.getContext(), () => this.draw());
        this.controls.addEventListener('start', () => this.detail.move());
        this.controls.addEventListener('change', () => { if (this.controls.state !== -1) this.detail.move(); this.draw(); });
        this.box = new THREE.Box3(new THREE.Vector3(-0.1, 1.5, -0.1), new THREE.Vector3(0.1, 1.8, 0.1));
        this.groom = this.#hair();
        this.target = this.#hair([0.24, 0.17, 0.11]);
        this.guides = new THREE.Group();
        this.cameras = new THREE.Group();
        const key = new THREE.DirectionalLight(0xfff4e6, 1.6);
        key.position.copy(Viewer.KEY);
        this.scene.add(this.guides, this.cameras, new THREE.HemisphereLight(0xdfe6f2, 0x60534a, 1.5), key);
        this.comparison = 'groom';
        this.wipe = 0.5;
        this.background = new THREE.Color(0x23262b);
        this.observer = new ResizeObserver(() => this.resize());
        this.observer.observe(parent);
        this.canvas.addEventListener('keydown', (event) => {
            const name = Object.keys(VIEWS)[Number(event.key) - 1];
            if (name) this.look(name);
        });
        this.look('front');
    }

    #hair(color) {
        const hair = new Hair(color);
        hair.visible = false;
        this.scene.add(hair);
        return hair;
    }

    /* --- what is shown ------------------------------------------------------ */

    frame(box) { this.box = box; }

    get diagonal() { return this.box.getSize(new THREE.Vector3()).length(); }

    show(hair, strands) {
        hair.show(strands);
        this.draw();
    }

    setHead(geometry) {
        if (this.head) this.scene.remove(this.head, this.occluder);
        geometry.computeVertexNormals();
        this.head = new THREE.Mesh(geometry, skin(this.groom.material.uniforms));
        this.occluder = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ colorWrite: false, side: THREE.DoubleSide }));
        this.occluder.renderOrder = 2;
        this.occluder.onBeforeRender = () => this.renderer.clearDepth();
        this.occluder.visible = this.guides.children.length > 0;
        this.scene.add(this.head, this.occluder);
        this.draw();
    }

    /* Polylines [count][vertices][3]; chosen: indices drawn in the other colour. Hair does not hide them, the head
     * does: depth is cleared behind the hair, and the head's drawn again. */
    setGuides({ points, count, vertices }, chosen = new Set()) {
        this.guides.clear();
        if (this.occluder) this.occluder.visible = count > 0;
        for (const [own, color] of [[(i) => !chosen.has(i), 0x5fb4ff], [(i) => chosen.has(i), 0xffb454]]) {
            const ends = [];
            for (let g = 0; g < count; g++)
                for (let j = 0; own(g) && j + 1 < vertices; j++)
                    for (let k = 0; k < 6; k++) ends.push(points[3 * (g * vertices + j) + k]);
            const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(ends, 3));
            const lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color }));
            lines.renderOrder = 3;
            this.guides.add(lines);
        }
        this.draw();
    }

    /* Cameras of a capture (groom/camera.h) as frusta of `depth` metres. */
    setCameras(cameras, depth = 0.12) {
        this.cameras.clear();
        const ends = cameras.flatMap((camera) => frustumOf(camera, depth));
        if (ends.length) {
            const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(ends, 3));
            this.cameras.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x9be28c })));
        }
        this.draw();
    }

    /* --- camera -------------------------------------------------------------- */

    look(name) {
        const direction = new THREE.Vector3(...VIEWS[name]).normalize();
        const centre = this.box.getCenter(new THREE.Vector3()), size = this.box.getSize(new THREE.Vector3());
        const narrow = Math.min(1, this.camera.aspect), half = 0.5 * MARGIN * Math.max(size.y, Math.max(size.x, size.z) / narrow);
        const distance = half / Math.tan((FIELD_OF_VIEW * Math.PI) / 360) + 0.5 * Math.max(size.x, size.z);
        this.camera.position.copy(centre).addScaledVector(direction, distance);
        this.controls.target.copy(centre);
        this.camera.near = distance / 50;
        this.camera.far = distance * 10;
        this.camera.updateProjectionMatrix();
        this.controls.update();
        this.draw();
    }

    /* A key light from the upper left, a rim from above and behind, as in the daemon's pictures; they
     * stand with the front view, so that shadows hold while the camera turns. */
    static KEY = new THREE.Vector3(-0.45, 0.65, 0.62).normalize();
    static RIM = new THREE.Vector3(0.55, 0.6, -0.58).normalize();

    resize() {
        const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
        if (!width || !height) return;
        this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
        this.renderer.setSize(width, height);
        this.draw();
    }

    /* --- drawing --------------------------------------------------------------- */

    draw() {
        if (this.waiting) return;
        if (this.detail.busy) { this.detail.again = true; return; }
        this.waiting = requestAnimationFrame(() => {
            this.waiting = 0;
            const each = Math.max(this.groom.vertices ?? 0, 2), segments = Math.max(this.groom.evaluated ?? 0, this.target.evaluated ?? 0) * each;
            const taken = this.detail.take(segments);
            this.most = Math.max(1, Math.round(taken / each));
            this.#render();
            this.detail.submitted(taken);
        });
    }

    #part(left, width, groom, target, { shifted = false } = {}) {
        const size = this.renderer.getSize(new THREE.Vector2()), x = left * size.x, w = width * size.x;
        const seen = shifted ? w : size.x;
        this.renderer.setViewport(shifted ? x : 0, 0, seen, size.y);
        this.renderer.setScissor(x, 0, w, size.y);
        this.camera.aspect = seen / size.y;
        this.camera.fov = shifted ? this.#fovFor(seen / size.y, size.x / size.y) : FIELD_OF_VIEW;
        this.camera.updateProjectionMatrix();
        for (const [hair, on] of [[this.groom, groom], [this.target, target]]) {
            const { uniforms } = hair.material;
            hair.visible = on && hair.count > 0;
            if (!hair.visible) continue;
            hair.draw(this.most, this.diagonal);
            uniforms.pixel.value = 2 * Math.tan((FIELD_OF_VIEW * Math.PI) / 360) / (size.y * this.renderer.getPixelRatio());
            uniforms.keyDirection.value.copy(Viewer.KEY);
            uniforms.rimDirection.value.copy(Viewer.RIM);
        }
        this.renderer.render(this.scene, this.camera);
    }

    /* A narrow part shows as much of the hair as the whole width did. */
    #fovFor(narrow, wide) {
        const size = this.box.getSize(new THREE.Vector3()), across = Math.max(size.x, size.z);
        const step = Math.max(size.y, across / narrow) / Math.max(size.y, across / wide);
        return (360 / Math.PI) * Math.atan(step * Math.tan((FIELD_OF_VIEW * Math.PI) / 360));
    }

    #render() {
        this.renderer.setScissorTest(true);
        const size = this.renderer.getSize(new THREE.Vector2());
        this.renderer.setScissor(0, 0, size.x, size.y);
        this.renderer.setClearColor(this.background);
        this.renderer.clear();
        switch (this.target.count ? this.comparison : 'groom') {
        case 'target': this.#part(0, 1, false, true); break;
        case 'overlay': this.#part(0, 1, true, true); break;
        case 'side by side':
            this.#part(0, 0.5, false, true, { shifted: true });
            this.#part(0.5, 0.5, true, false, { shifted: true });
            break;
        case 'wipe':
            this.#part(0, this.wipe, false, true);
            this.#part(this.wipe, 1 - this.wipe, true, false);
            break;
        default: this.#part(0, 1, true, false);
        }
    }

    dispose() {
        cancelAnimationFrame(this.waiting);
        this.observer.disconnect();
        this.detail.stop();
        this.controls.dispose();
        this.groom.dispose();
        this.target.dispose();
        this.renderer.dispose();
        this.canvas.remove();
    }
}
