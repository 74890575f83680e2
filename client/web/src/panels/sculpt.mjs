/* Sculpting (Shi et al. 2026, 5.3): strands in clusters, a few oriented frames along each; the groomer
 * moves frames, the daemon bends the strands after them and keeps their curls. */
import * as THREE from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import { call, get } from '../api.mjs';
import { action, element, notice, say } from '../dom.mjs';

const FRAMES = 4, NEAR_PX = 14;

/* A frame of the armature as an object that can be moved, with its place at rest. */
function objectOf({ position, axes }) {
    const object = new THREE.Object3D();
    object.position.fromArray(position);
    object.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(...axes.map((axis) => new THREE.Vector3(...axis))));
    object.updateMatrix();
    return object;
}

class Armature {
    constructor(viewer, session) {
        Object.assign(this, { viewer, session, joints: [], stiffness: 10 });
        this.markers = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ size: 9, sizeAttenuation: false, depthTest: false, vertexColors: true }));
        Object.assign(this.markers, { visible: false, renderOrder: 2, frustumCulled: false });
        this.gizmo = new TransformControls(viewer.camera, viewer.canvas);
        this.gizmo.setSize(0.7);
        this.gizmo.addEventListener('change', () => viewer.draw());
        this.gizmo.addEventListener('objectChange', () => this.attempt());
        this.gizmo.addEventListener('dragging-changed', ({ value }) => {
            viewer.controls.enabled = !value;
            if (!value) this.commit().catch(notice);
        });
        viewer.scene.add(this.markers, this.gizmo.getHelper());
        viewer.canvas.addEventListener('pointerdown', (event) => this.#press(event));
    }

    async start(count) {
        const { clusters } = await get(`${this.session.at}/clusters?count=${count}&frames=${FRAMES}&seed=1`);
        Object.assign(this, { count, layer: undefined });
        this.joints = clusters.filter((c) => c.strands > 0).flatMap((c) => c.frames.map((frame) => {
            const object = objectOf(frame);
            this.viewer.scene.add(object);
            return { cluster: c.cluster, at: frame.at, object, rest: object.matrix.clone() };
        }));
        this.#show();
    }

    stop() {
        this.gizmo.detach();
        this.joints.forEach(({ object }) => this.viewer.scene.remove(object));
        this.joints = [];
        this.#show();
    }

    #show() {
        const color = new THREE.Color(), colors = [], places = [];
        for (const { cluster, object } of this.joints) {
            color.setHSL((cluster * 0.381966) % 1, 0.8, 0.6);
            colors.push(color.r, color.g, color.b);
            places.push(...object.position.toArray());
        }
        this.markers.geometry.setAttribute('position', new THREE.Float32BufferAttribute(places, 3));
        this.markers.geometry.setAttribute('color', new THREE.Float32BufferAttribute(colors, 3));
        this.markers.visible = this.joints.length > 0;
        this.viewer.draw();
    }

    #press(event) {
        if (!this.joints.length || this.gizmo.axis) return;
        const { width, height } = this.viewer.canvas.getBoundingClientRect();
        let least = NEAR_PX, found = null;
        for (const joint of this.joints) {
            const q = joint.object.position.clone().project(this.viewer.camera);
            const d = Math.hypot(((q.x + 1) / 2) * width - event.offsetX, ((1 - q.y) / 2) * height - event.offsetY);
            if (d < least) { least = d; found = joint; }
        }
        if (found) this.gizmo.attach(found.object);
        this.viewer.draw();
    }

    /* Frames that were moved, each as the affine map from where it rested. */
    get frames() {
        return this.joints.flatMap(({ cluster, at, object, rest }) => {
            object.updateMatrix();
            if (object.matrix.equals(rest)) return [];
            const e = object.matrix.clone().multiply(rest.clone().invert()).elements;
            return [{ cluster, at, transform: [0, 1, 2].map((row) => [e[row], e[row + 4], e[row + 8], e[row + 12]]) }];
        });
    }

    #body(commit) {
        return { clusters: { count: this.count, seed: 1 }, frames: this.frames, stiffness: this.stiffness, layer: this.layer, commit };
    }

    /* Under the hand: one attempt at a time, the last position wins. */
    async attempt() {
        this.#show();
        if (this.trying) { this.again = true; return; }
        this.trying = true;
        try {
            do {
                this.again = false;
                const { json } = await call('POST', `${this.session.at}/sculpt`, { body: this.#body(false), headers: { 'If-Match': this.session.etag } });
                if (json.points) await this.session.tryOn(json.points);
                say(`${json.strands.edited} strands, ${(1000 * json.seconds).toFixed(0)} ms`);
            } while (this.again);
        } catch (error) {
            if (error.status !== 413) notice(error); /* too many for a try: seen when the hand rests */
        } finally { this.trying = false; }
    }

    async commit() {
        if (!this.frames.length) return;
        const answer = await this.session.layer('sculpt', this.#body(true));
        this.layer = answer.layer;
    }
}

export function sculptPanel(parent, session, viewer) {
    const armature = new Armature(viewer, session);
    const count = element('input', { type: 'number', min: 1, max: 200, value: 12 });
    const stiffness = element('input', { type: 'range', min: 0, max: 100, value: 10, oninput: () => { armature.stiffness = Number(stiffness.value); }, onchange: () => armature.commit().catch(notice) });
    const mode = (name, label) => element('button', { type: 'button', onclick: () => armature.gizmo.setMode(name) }, label);
    const start = action('show armature', async () => {
        if (armature.joints.length) armature.stop();
        else await armature.start(Number(count.value));
        start.textContent = armature.joints.length ? 'done' : 'show armature';
    });
    parent.append(element('section', { class: 'panel' }, element('h2', {}, 'Sculpt'),
        element('label', {}, 'locks', count), element('label', {}, 'keeps its curls', stiffness),
        element('div', { class: 'row' }, start, mode('translate', 'move'), mode('rotate', 'turn'), mode('scale', 'scale'))));
    return armature;
}
