/* A guide under the hand: pick it, drag a vertex, and its length is kept. */
import * as THREE from 'three';
import { notice, say } from './dom.mjs';
import { arrayOf } from './strands.mjs';

/* Where arrows move a point, right and up in the picture. */
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const STEP_M = 0.004, NEAR_PX = 12, HANDLES = 9, ROUNDS = 8;

const vertex = (points, j) => new THREE.Vector3().fromArray(points, 3 * j);

/* Where vertex j goes to `to`, as far as the strand reaches: what lies before it bends and keeps its
 * segments (forward and backward reaching: Aristidou and Lasenby 2011), what lies behind it comes along. */
export function dragVertex(points, j, to) {
    const m = points.length / 3, chain = Array.from({ length: m }, (_, i) => vertex(points, i)), root = chain[0].clone(), from = chain[j].clone();
    const lengths = chain.slice(1).map((p, i) => p.distanceTo(chain[i])), pull = (p, anchor, length) => p.sub(anchor).setLength(length).add(anchor);
    for (let round = 0; round < ROUNDS; round++) {
        chain[j].copy(to);
        for (let i = j - 1; i >= 0; i--) pull(chain[i], chain[i + 1], lengths[i]);
        chain[0].copy(root);
        for (let i = 1; i <= j; i++) pull(chain[i], chain[i - 1], lengths[i - 1]);
    }
    const shift = chain[j].clone().sub(from), out = new Float32Array(points.length);
    chain.forEach((p, i) => (i > j ? p.add(shift) : p).toArray(out, 3 * i));
    return out;
}

/* USC .data, metres and y up. */
function fileOf(points, count, vertices) {
    const file = new DataView(new ArrayBuffer(4 + count * (4 + 12 * vertices)));
    file.setInt32(0, count, true);
    for (let g = 0, at = 4; g < count; g++) {
        file.setInt32(at, vertices, true);
        at += 4;
        for (let i = 0; i < 3 * vertices; i++, at += 4) file.setFloat32(at, points[3 * g * vertices + i], true);
    }
    return file.buffer;
}

export class GuideEditor {
    constructor(viewer, session) {
        Object.assign(this, { viewer, session, on: false, chosen: -1 });
        this.handles = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: 0xffffff, size: 8, sizeAttenuation: false, depthTest: false }));
        this.line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xffffff, depthTest: false }));
        for (const part of [this.handles, this.line]) Object.assign(part, { visible: false, renderOrder: 4, frustumCulled: false });
        viewer.scene.add(this.handles, this.line);
        viewer.canvas.addEventListener('pointerdown', (event) => this.#press(event), { capture: true });
        viewer.canvas.addEventListener('pointermove', (event) => this.#move(event));
        viewer.canvas.addEventListener('pointerup', () => this.#release());
        viewer.canvas.addEventListener('keydown', (event) => this.#key(event));
        viewer.canvas.addEventListener('keyup', (event) => { if (KEYS[event.key] && this.moved) this.settle().catch(notice); });
        session.addEventListener('document', () => this.#load());
        this.#load();
    }

    #load() {
        const guides = this.session.document.guides ?? { points: { dtype: 'f32', data: '' }, count: 0, vertices: 0 }; /* a base has none */
        this.points = arrayOf(guides.points);
        Object.assign(this, { count: guides.count, vertices: guides.vertices });
        this.#show();
    }

    enable(on) {
        Object.assign(this, { on, chosen: -1 });
        this.#show();
    }

    get guide() { return this.points.subarray(3 * this.chosen * this.vertices, 3 * (this.chosen + 1) * this.vertices); }

    /* The vertices that have a handle: some, evenly, not the root. */
    get grips() {
        const n = Math.min(HANDLES, this.vertices - 1);
        return Array.from({ length: n }, (_, i) => Math.round(((i + 1) * (this.vertices - 1)) / n));
    }

    #show() {
        const visible = this.on && this.chosen >= 0;
        this.handles.visible = this.line.visible = visible;
        if (visible) {
            this.line.geometry.setAttribute('position', new THREE.BufferAttribute(this.guide.slice(), 3));
            this.handles.geometry.setFromPoints(this.grips.map((j) => vertex(this.guide, j)));
        }
        this.viewer.draw();
    }

    #toScreen(p) {
        const { width, height } = this.viewer.canvas.getBoundingClientRect(), q = p.project(this.viewer.camera);
        return new THREE.Vector2(((q.x + 1) / 2) * width, ((1 - q.y) / 2) * height);
    }

    #nearest(at, places) {
        let best = -1, least = NEAR_PX;
        for (const [i, place] of places) {
            const d = at.distanceTo(this.#toScreen(place));
            if (d < least) { least = d; best = i; }
        }
        return best;
    }

    *#allVertices() {
        for (let g = 0; g < this.count; g++)
            for (let j = 0; j < this.vertices; j += 2) yield [g, vertex(this.points, g * this.vertices + j)];
    }

    #press(event) {
        if (!this.on || event.button !== 0) return;
        const at = new THREE.Vector2(event.offsetX, event.offsetY);
        this.grip = this.chosen < 0 ? -1 : this.#nearest(at, this.grips.map((j) => [j, vertex(this.guide, j)]));
        if (this.grip >= 0) {
            this.viewer.controls.enabled = false;
            this.viewer.canvas.setPointerCapture(event.pointerId);
            const normal = this.viewer.camera.getWorldDirection(new THREE.Vector3());
            this.plane = new THREE.Plane().setFromNormalAndCoplanarPoint(normal, vertex(this.guide, this.grip));
            this.moved = false;
            return;
        }
        const picked = this.#nearest(at, this.#allVertices());
        if (picked >= 0) this.chosen = picked;
        this.#show();
    }

    /* Without a mouse: [ and ] pick a guide, - and + one of its points, arrows move that. */
    #key(event) {
        if (!this.on || !this.count) return;
        const next = { '[': -1, ']': 1 }[event.key], along = { '-': -1, '+': 1, '=': 1 }[event.key], arrow = KEYS[event.key];
        if (next) {
            this.chosen = (this.chosen < 0 && next < 0 ? this.count : this.chosen) + next;
            this.chosen = (this.chosen + this.count) % this.count;
            this.grip = this.vertices - 1;
        } else if (along && this.chosen >= 0) {
            const at = Math.max(0, this.grips.indexOf(this.grip));
            this.grip = this.grips[Math.max(0, Math.min(this.grips.length - 1, at + along))];
        } else if (arrow && this.chosen >= 0) {
            const x = new THREE.Vector3(), y = new THREE.Vector3();
            this.viewer.camera.matrixWorld.extractBasis(x, y, new THREE.Vector3());
            this.grip = this.grips.includes(this.grip) ? this.grip : this.vertices - 1;
            this.drag(this.chosen, this.grip, vertex(this.guide, this.grip).addScaledVector(x, STEP_M * arrow[0]).addScaledVector(y, STEP_M * arrow[1]));
        } else return;
        event.preventDefault();
        say(`guide ${this.chosen + 1} of ${this.count}, point ${this.grips.indexOf(this.grip) + 1} of ${this.grips.length}`);
        this.#show();
    }

    #move(event) {
        if (!this.plane) return;
        const { width, height } = this.viewer.canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
        ray.setFromCamera(new THREE.Vector2((event.offsetX / width) * 2 - 1, 1 - (event.offsetY / height) * 2), this.viewer.camera);
        const to = ray.ray.intersectPlane(this.plane, new THREE.Vector3());
        if (to) this.drag(this.chosen, this.grip, to);
    }

    drag(guide, j, to) {
        this.chosen = guide;
        this.guide.set(dragVertex(this.guide, j, to));
        this.moved = true;
        this.#show();
        this.session.moveGuide(guide, this.guide.slice()).catch(notice);
    }

    #release() {
        if (!this.plane) return;
        this.plane = null;
        this.viewer.controls.enabled = true;
        if (this.moved) this.settle().catch(notice);
    }

    settle() {
        this.moved = false;
        return this.session.putGuides(fileOf(this.points, this.count, this.vertices));
    }
}
