/* Pictures by the server's own rasteriser, with the page's shading: from the camera of the page, from a view, or
 * all around. */
import { tell } from '../commands.mjs';
import { element } from '../dom.mjs';
import { lines } from './commands.mjs';
import { fileName, pick } from './export.mjs';

const FROM = { page: 'as it is shown here', front: 'the front', side: 'the side', back: 'the back', top: 'above', turn: 'all around (animated)' };
const SIZES = { 512: '512 pixels', 1024: '1024 pixels', 2048: '2048 pixels' };
const LARGEST_FRAME = 1024, FRAMES = 36;

const place = (vector) => vector.toArray().map((x) => x.toFixed(4)).join(',');

/* The camera of the page, whose picture is as wide as the page's part for it. */
function pageCamera(viewer, size) {
    const { clientWidth: width, clientHeight: height } = viewer.canvas, scale = size / Math.max(width, height, 1);
    const side = (n) => Math.max(64, Math.round(n * scale));
    return { eye: place(viewer.camera.position), target: place(viewer.controls.target), size: `${side(width)}x${side(height)}`, light: 'front' };
}

/* Where it stands around what it looks at. */
function heightOf(viewer) {
    const from = viewer.camera.position.clone().sub(viewer.controls.target);
    return { azimuth: Math.atan2(from.x, from.z).toFixed(4), elevation: Math.atan2(from.y, Math.hypot(from.x, from.z)).toFixed(4) };
}

function pictureCall(session, viewer, from, size) {
    const query = from === 'turn' ? { frames: FRAMES, size: Math.min(size, LARGEST_FRAME), ...heightOf(viewer) }
        : from === 'page' ? pageCamera(viewer, size) : { view: from, size };
    const path = `${session.at}/${from === 'turn' ? 'turntable' : 'preview'}.png?${new URLSearchParams({ ...query, revision: session.revision })}`;
    return { method: 'GET', path, file: fileName(session, from === 'turn' ? 'turntable.png' : 'png') };
}

export function picturePanel(parent, session, viewer) {
    const form = element('form', { class: 'panel', 'aria-label': 'Picture', onsubmit: (event) => event.preventDefault() }, element('h2', {}, 'Picture'),
        pick('from', 'from', FROM), pick('larger side', 'side', SIZES, '1024'));
    const both = lines(), call = () => pictureCall(session, viewer, form.elements.from.value, Number(form.elements.side.value));
    const remember = () => tell(call());
    const open = element('a', { class: 'button', target: '_blank', onclick: remember }, 'Open'), save = element('a', { class: 'button', onclick: remember }, 'Save');
    form.append(element('div', { class: 'row' }, open, save), both.rows[0], both.rows[1]);
    const refresh = () => {
        const now = call();
        open.href = save.href = now.path;
        save.download = now.file;
        both.say(now);
    };
    let waiting = 0;
    const soon = () => { waiting ||= requestAnimationFrame(() => { waiting = 0; refresh(); }); };
    viewer.controls.addEventListener('change', soon);
    new ResizeObserver(soon).observe(viewer.canvas);
    form.addEventListener('input', refresh);
    session.addEventListener('revision', refresh);
    refresh();
    parent.append(form);
}
