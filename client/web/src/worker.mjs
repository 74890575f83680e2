/* The engine's thread: holds the groom, answers with strands. Requests are { id, name, ...arguments };
 * answers { id, value } or { id, error }. Arrays in answers are handed over, not copied. */
import { Engine, Groom } from '../engine/engine.mjs';

const engine = Engine.load(fetch('/studio/engine.wasm'));
let whole = null, shown = null;

function choose(count) {
    const n = Math.max(1, Math.min(count, whole.count));
    shown?.destroy();
    shown = whole.select(n); /* in the fair order, all of them, too */
}

const both = (work) => { work(whole); work(shown); };

const calls = {
    async about() { return { types: (await engine).types }; },
    async fair({ n, count }) { return (await engine).fair(n, count); },
    async open({ document, count }) {
        const loaded = await engine;
        shown?.destroy();
        whole?.destroy();
        whole = shown = null;
        whole = Groom.fromDocument(loaded, document);
        choose(count);
        return { types: loaded.types, count: whole.count, vertices: whole.vertices };
    },
    choose: ({ count }) => choose(count),
    set: async ({ index, type, parameter, value }) => {
        const known = (await engine).typeOf(type);
        both((groom) => groom.set(index, known, parameter, value));
    },
    moveGuide: ({ guide, points }) => both((groom) => groom.moveGuide(guide, points)),
    enable: ({ index, operator }) => both((groom) => groom.enable(index, operator)),
    /* The first `most` of the strands that are shown. `spare` comes back with new points where it fits: pages
     * that are fresh from the system cost as much as the strands on them. */
    evaluate({ most = Infinity, spare }) {
        const evaluated = Math.max(1, Math.min(shown.count, Math.floor(most)));
        const from = performance.now(), made = shown.evaluate(0, evaluated);
        const value = { count: shown.count, vertices: shown.vertices, evaluated, ms: performance.now() - from };
        const n = 3 * shown.count * shown.vertices + 9; /* one vertex of room before and two behind, for the ends of the ribbons */
        value.points = spare?.length === n ? spare : new Float32Array(n);
        value.points.set(made, 3);
        return value;
    },
    light: async ({ strands, ...options }) => (strands
        ? (await engine).lightOf(strands.points.subarray(3, -6), strands.count, strands.vertices, options)
        : shown.light(options)),
};

self.onmessage = async ({ data: { id, name, ...given } }) => {
    try {
        const value = await calls[name](given);
        const handed = [value?.points, value?.data].filter(Boolean).map((array) => array.buffer);
        self.postMessage({ id, value }, handed);
    } catch (error) {
        self.postMessage({ id, error: { message: error.message, pointer: error.pointer } });
    }
};
