/* Hairlines to start from, made of today's on the same head: each handle goes up the scalp by so many metres
 * for a line of LENGTH_M, or down into the forehead. */
import * as THREE from 'three';

const LENGTH_M = 0.3, ROUNDS = 4;
const bump = (s, at, width) => Math.exp(-(((s - at) / width) ** 2));
const ramp = (s, from, to) => THREE.MathUtils.smoothstep(s, from, to);
const front = (s) => ramp(s, 0.12, 0.3) * (1 - ramp(s, 0.7, 0.88));

/* s: 0 at one ear, 1 at the other; y: how high the handle stands, mean: those over the forehead.
 * kind: what a retargeting makes of the line */
export const SHAPES = {
    'as it is': { kind: 'front', rise: () => 0 },
    'widow’s peak': { kind: 'front', rise: (s) => 0.010 * (bump(s, 0.3, 0.12) + bump(s, 0.7, 0.12)) - 0.010 * bump(s, 0.5, 0.08) },
    straight: { kind: 'front', rise: (s, y, mean) => front(s) * (mean - y) },
    receding: { kind: 'balding', rise: (s) => 0.028 * (bump(s, 0.3, 0.11) + bump(s, 0.7, 0.11)) + 0.012 * bump(s, 0.5, 0.15) },
};

const lengthOf = (points) => points.slice(1).reduce((sum, p, i) => sum + p.distanceTo(points[i]), 0);

/* handles  today's, on the surface; returns as many others, on it too */
export function shaped(name, handles, surface) {
    const n = handles.length - 1, share = lengthOf(handles) / LENGTH_M, { rise } = SHAPES[name];
    const forehead = handles.filter((_, i) => front(i / n) > 0.9), mean = forehead.reduce((sum, p) => sum + p.y, 0) / forehead.length;
    const up = new THREE.Vector3(0, 1, -0.5).normalize();
    return handles.map((handle, i) => {
        const by = name === 'straight' ? rise(i / n, handle.y, mean) : share * rise(i / n), p = handle.clone();
        for (let round = 0; by && round < ROUNDS; round++) p.copy(surface.closest(p.clone().addScaledVector(up, by / ROUNDS)) ?? p);
        return p;
    });
}
