/* What strands are coloured by: numbers of each vertex, from the daemon's analysis or against the target, each
 * with a palette, a range and words for the legend. */
import { bytes } from './api.mjs';
import { arrayOf } from './strands.mjs';

const SAMPLE = 4096; /* values that a range is found from */

/* Anchors of palettes, dark to bright or from side to side (linear RGB is close enough to tell apart). */
const RISING = ['#2c1e6b', '#3f64c0', '#2f9d9a', '#8bd04f', '#fde74c'];
const SIDES = ['#ff8a3d', '#9a6a4d', '#6e6e76', '#3f7fae', '#37c2ff'];
const HEAT = ['#1f3b57', '#2f7f7a', '#d0c04a', '#f07a35', '#ff3048'];

/* column: of the analysis; shown: from the number to what the legend says */
export const COLOURS = {
    none: { label: 'hair' },
    radius: { label: 'curl radius', column: 0, palette: RISING, unit: 'mm', scale: 1000, logarithmic: true },
    hand: { label: 'handedness', column: 2, palette: SIDES, range: [-1, 1], words: ['left', 'straight', 'right'] },
    beta: { label: 'beta', column: 3, palette: SIDES, range: [-1, 1], words: ['−1: left helix', '0: wave', '1: right helix'] },
    movement: { label: 'moved onto this head', carried: 'movement', palette: HEAT, unit: 'mm', scale: 1000 },
    depth: { label: 'was inside this head', carried: 'depth', whole: true, palette: HEAT, unit: 'mm', scale: 1000 },
    stretch: { label: 'change of length', carried: 'stretch', less: 1, palette: SIDES, about: 0, unit: '%', scale: 100 },
    density: { label: 'change of root density', carried: 'density', palette: SIDES, about: 0, unit: '%', scale: 100 },
    distance: { label: 'distance to the target', palette: HEAT, unit: 'mm', scale: 1000, target: true },
};

/* An RGBA row of 256 steps. */
export function paletteOf(anchors) {
    const rgb = anchors.map((text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16))), data = new Uint8Array(1024);
    for (let i = 0; i < 256; i++) {
        const at = (i / 255) * (rgb.length - 1), k = Math.min(Math.floor(at), rgb.length - 2), f = at - k;
        for (let c = 0; c < 3; c++) data[4 * i + c] = rgb[k][c] + f * (rgb[k + 1][c] - rgb[k][c]);
        data[4 * i + 3] = 255;
    }
    return data;
}

/* From the 5th to the 95th of a hundred, so that a few stray vertices do not bleach the rest. */
function rangeOf(values, from_zero) {
    const step = Math.max(1, Math.floor(values.length / SAMPLE)), some = [];
    for (let i = 0; i < values.length; i += step) if (Number.isFinite(values[i])) some.push(values[i]);
    some.sort((a, b) => a - b);
    const at = (share) => some[Math.min(some.length - 1, Math.floor(share * some.length))] ?? 0;
    const [low, high] = [from_zero ? 0 : at(0.05), at(0.95)];
    return high > low ? [low, high] : [low, low + 1e-9];
}

/* One column of the daemon's analysis of the strands that are shown: [count * vertices], in their order. */
async function analysed({ column, logarithmic }, session, slotOf) {
    const { at, revision, count, document: { strands: { vertices } } } = session;
    const table = new Float32Array(await bytes(`${at}/analysis?format=binary&revision=${revision}&count=${count}`));
    const values = new Float32Array(count * vertices);
    for (let strand = 0; strand < count; strand++)
        for (let j = 0, to = slotOf[strand] * vertices, from = 4 * strand * vertices + column; j < vertices; j++, from += 4)
            values[to + j] = logarithmic ? (table[from] > 0 ? Math.log(table[from]) : NaN) : table[from];
    return values;
}

/* Those that this groom has something for. */
export const coloursOf = ({ retarget }) => Object.entries(COLOURS).filter(([, { carried }]) => !carried || retarget?.strands?.[carried]);

/* Numbers of whole strands, of the retargeting that brought them here. */
function ofStrands({ carried, less = 0 }, { order, document: { retarget, strands: { vertices } } }) {
    const table = arrayOf(retarget.strands[carried]), values = new Float32Array(order.length * vertices);
    order.forEach((strand, slot) => values.fill(table[strand] - less, slot * vertices, (slot + 1) * vertices));
    return values;
}

/* Of what few strands have, and these count. */
const rangeToMost = (values) => [0, Math.max(1e-5, values.reduce((most, value) => Math.max(most, value), 0))];

/* As far to both sides. */
function rangeAbout(values, middle) {
    const [low, high] = rangeOf(values), most = Math.max(middle - low, high - middle, 1e-6);
    return [middle - most, middle + most];
}

/* How far each vertex is from that of the target's same strand, at the same share of its length. */
export function distances(strands, target) {
    const n = strands.count * strands.vertices, values = new Float32Array(n), a = strands.points, b = target.points;
    for (let i = 0, k = 3; i < n; i++, k += 3) values[i] = Math.hypot(a[k] - b[k], a[k + 1] - b[k + 1], a[k + 2] - b[k + 2]);
    return values;
}

/* { values, range, palette, labels } of the strands that are shown. */
export async function colourBy(name, { session, strands, target, slotOf }) {
    const colour = COLOURS[name], values = colour.target ? distances(strands, target) : colour.carried ? ofStrands(colour, session) : await analysed(colour, session, slotOf);
    const range = colour.range ?? (colour.whole ? rangeToMost(values) : colour.about === undefined ? rangeOf(values, colour.target || colour.carried) : rangeAbout(values, colour.about)), number = (v) => ((colour.logarithmic ? Math.exp(v) : v) * colour.scale).toPrecision(2);
    const labels = colour.words ?? [number(range[0]), number((range[0] + range[1]) / 2), `${number(range[1])} ${colour.unit}`];
    return { values, range, palette: paletteOf(colour.palette), anchors: colour.palette, labels };
}
