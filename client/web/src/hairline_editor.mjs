/* The hairline on a head: today's line, moved by handles on it that are dragged along the surface. What lies between
 * handles stays as it is, smoothly moved with them: a smooth line through the handles of a jagged one would fold the
 * scalp between its teeth before anything is moved. */
import * as THREE from 'three';
import { say } from './dom.mjs';
import { shaped } from './hairline_shapes.mjs';
import { Surface } from './viewer/surface.mjs';

const HANDLES = 11, BETWEEN = 4, LESS = 0.25, STEP_M = 0.001, NEAR_PX = 14, HIDDEN_M = 0.01, AROUND_M = 0.12;
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
/* Of today's line: every BETWEEN-th is a handle. */
export const POINTS = BETWEEN * (HANDLES - 1) + 1;
const BALL = new THREE.SphereGeometry(0.0032, 16, 12);

const tube = (radius, color) => Object.assign(new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ color })), { radius });

function lay(mesh, points) {
    mesh.geometry.dispose();
    mesh.geometry = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points), 4 * points.length, mesh.radius, 6);
}

export class HairlineEditor extends EventTarget {
    constructor(viewer) {
        super();
        Object.assign(this, { viewer, handles: [], chosen: -1, balls: [], today: tube(0.0006, 0xd0d4da), curve: tube(0.0013, 0x5fb4ff), group: new THREE.Group() });
        this.group.visible = false;
        this.group.add(this.today, this.curve);
        viewer.scene.add(this.group);
        viewer.canvas.addEventListener('pointerdown', (event) => this.#press(event), { capture: true });
        viewer.canvas.addEventListener('pointermove', (event) => this.#drag(event));
        for (const name of ['pointerup', 'pointercancel']) viewer.canvas.addEventListener(name, () => this.#release());
        viewer.canvas.addEventListener('keydown', (event) => this.#key(event));
    }

    /* The head's line of today, [POINTS] of [x, y, z]; the head is the viewer's. */
    open(front) {
        this.line = front.map((p) => new THREE.Vector3(...p));
        this.first = this.line.filter((_, i) => i % BETWEEN === 0);
        const box = new THREE.Box3().setFromPoints(this.line);
        this.surface = new Surface(this.viewer.head.geometry, box.clone().expandByScalar(AROUND_M));
        this.group.remove(...this.balls);
        this.balls = this.first.map(() => new THREE.Mesh(BALL, new THREE.MeshBasicMaterial()));
        this.group.add(...this.balls);
        this.group.visible = true;
        this.chosen = -1;
        this.take('as it is');
        lay(this.today, this.points);
        return box;
    }

    /* As it was left, on the same head and line: what `handles` and `moved` were. */
    restore({ handles, moved }) {
        Object.assign(this, { handles, moved });
        this.#show();
    }

    close() {
        Object.assign(this, { handles: [], chosen: -1 });
        this.group.visible = false;
        this.#release();
        this.viewer.draw();
    }

    /* One of SHAPES, in place of what stands. */
    take(name) {
        this.handles = shaped(name, this.first, this.surface);
        this.moved = name !== 'as it is';
        this.#show();
    }

    /* A quarter of the way back to today's line: what a line needs that would fold the scalp. */
    lessen() {
        this.handles = this.handles.map((handle, i) => {
            const p = handle.clone().lerp(this.first[i], LESS);
            return this.surface.closest(p) ?? p;
        });
        this.#show();
    }

    /* The curve as it is drawn, on the surface. */
    get points() {
        const moves = new THREE.CatmullRomCurve3(this.handles.map((handle, i) => handle.clone().sub(this.first[i])));
        return this.line.map((today, i) => {
            const p = moves.getPoint(i / (this.line.length - 1)).add(today);
            return this.surface.closest(p) ?? p;
        });
    }

    #show() {
        lay(this.curve, this.points);
        this.balls.forEach((ball, i) => {
            ball.position.copy(this.handles[i]);
            ball.material.color.set(i === this.chosen ? 0xffb454 : 0xffffff);
        });
        this.viewer.draw();
        this.dispatchEvent(new Event('change'));
    }

    #ray(x, y) {
        const ray = new THREE.Raycaster();
        ray.setFromCamera(new THREE.Vector2(x, y), this.viewer.camera);
        return ray.intersectObject(this.viewer.head)[0];
    }

    #hidden(handle, { x, y }) {
        const hit = this.#ray(x, y);
        return hit && hit.distance < handle.distanceTo(this.viewer.camera.position) - HIDDEN_M;
    }

    #press(event) {
        if (!this.group.visible || event.button !== 0) return;
        const { width, height } = this.viewer.canvas.getBoundingClientRect();
        let least = NEAR_PX, found = -1;
        this.handles.forEach((handle, i) => {
            const q = handle.clone().project(this.viewer.camera);
            const d = Math.hypot(((q.x + 1) / 2) * width - event.offsetX, ((1 - q.y) / 2) * height - event.offsetY);
            if (d < least && !this.#hidden(handle, q)) { least = d; found = i; }
        });
        if (found < 0) return;
        this.chosen = found;
        this.dragging = true;
        this.viewer.controls.enabled = false;
        this.viewer.canvas.setPointerCapture(event.pointerId);
        this.#show();
    }

    #drag(event) {
        if (!this.dragging) return;
        const { width, height } = this.viewer.canvas.getBoundingClientRect();
        const hit = this.#ray((event.offsetX / width) * 2 - 1, 1 - (event.offsetY / height) * 2);
        if (hit) this.move(this.chosen, hit.point);
    }

    #release() {
        if (!this.dragging) return;
        this.dragging = false;
        this.viewer.controls.enabled = true;
    }

    /* A handle goes to the surface's point closest to `to`. */
    move(handle, to) {
        const p = this.surface.closest(to);
        if (!p) return;
        this.handles = this.handles.with(handle, p);
        this.moved = true;
        this.#show();
    }

    /* Without a mouse: [ and ] pick a handle, arrows move it by a millimetre, right and up in the picture. */
    #key(event) {
        const next = { '[': -1, ']': 1 }[event.key], arrow = KEYS[event.key], n = this.handles.length;
        if (!n || !(next || (arrow && this.chosen >= 0))) return;
        event.preventDefault();
        if (next) {
            this.chosen = ((this.chosen < 0 && next < 0 ? n : this.chosen) + next + n) % n;
            this.#show();
        } else {
            const x = new THREE.Vector3(), y = new THREE.Vector3();
            this.viewer.camera.matrixWorld.extractBasis(x, y, new THREE.Vector3());
            this.move(this.chosen, this.handles[this.chosen].clone().addScaledVector(x, STEP_M * arrow[0]).addScaledVector(y, STEP_M * arrow[1]));
        }
        say(`handle ${this.chosen + 1} of ${n}, ${(1000 * this.handles[this.chosen].distanceTo(this.first[this.chosen])).toFixed(0)} mm from where it was`);
    }
}
