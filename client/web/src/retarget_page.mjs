/* Strands, or a groom, to another head: which one, how, and with what hairline, which is dragged on it. */
import { call, get } from './api.mjs';
import { action, by_id, element, notice, say } from './dom.mjs';
import { HairlineEditor, POINTS } from './hairline_editor.mjs';
import { SHAPES } from './hairline_shapes.mjs';
import { retargetForm } from './retarget_form.mjs';
import { fetchHead } from './strands.mjs';
import { Viewer } from './viewer/viewer.mjs';

const KINDS = { front: 'move roots along', balding: 'give up the hair before it' };
const MARGIN_M = 0.07;
/* What was asked for last, by subject: a hairline that is refused is there to be mended. */
const kept = new Map();
const rounded = (p) => p.toArray().map((x) => Number(x.toFixed(6)));

/* { subject, name, own, chained } of a groom or an upload. */
async function subjectOf(id) {
    if (id.startsWith('str_')) return { subject: { strands: id }, name: (await get(`/v1/strands/${id}`)).name || id, back: '#/' };
    const document = await get(`/v1/grooms/${id}?arrays=false`);
    return { subject: { groom: id }, name: document.name || id, own: document.source?.head, chained: !document.base, back: `#/grooms/${id}` };
}

/* The target's head in the picture, and today's hairline on it when it is asked for. */
class Target {
    constructor(viewer, editor) { Object.assign(this, { viewer, editor, shown: null }); }

    async show(head) {
        if (head === this.shown) return;
        this.shown = head;
        const geometry = await fetchHead(head);
        if (head !== this.shown) return; /* another was chosen meanwhile */
        this.viewer.setHead(geometry);
        geometry.computeBoundingBox();
        this.#look(geometry.boundingBox);
    }

    #look(box) {
        this.viewer.frame(box);
        this.viewer.look('front');
    }

    async hairline(given, head) {
        const { json: { front } } = await call('POST', `/v1/heads/${head}/hairline`, { body: { ...given, points: POINTS } });
        if (head === this.shown) this.#look(this.editor.open(front).expandByScalar(MARGIN_M));
    }
}

function hairlinePanel(editor, ask) {
    const kind = element('select', { 'aria-label': 'What the line does' }, Object.entries(KINDS).map(([value, text]) => element('option', { value }, text)));
    const shapes = Object.keys(SHAPES).map((name) => element('button', { type: 'button', onclick: () => {
        editor.take(name);
        kind.value = SHAPES[name].kind;
    } }, name));
    const less = element('button', { type: 'button', onclick: () => editor.lessen(), title: 'Each handle a quarter of the way back, for a line that would fold the scalp' }, 'closer to today’s');
    const words = element('p', { role: 'status', class: 'hint' });
    const tools = element('div', { hidden: true }, element('div', { class: 'row', role: 'group', 'aria-label': 'Hairlines to start from' }, shapes), element('div', { class: 'row' }, element('label', {}, 'and', kind), less), words,
        element('p', { class: 'hint' }, 'Drag a handle along the head. Without a mouse, in the picture: [ and ] pick a handle, arrows move it by a millimetre. “As it is” takes all back.'));
    const start = action('Edit the hairline', async () => {
        if (editor.handles.length) editor.close();
        else await ask();
        show();
    });
    const show = () => {
        const open = editor.handles.length > 0;
        tools.hidden = !open;
        start.textContent = open ? 'Leave the hairline as it is' : 'Edit the hairline';
        less.disabled = !editor.moved;
        words.textContent = editor.moved ? 'It goes with the job as it is drawn.' : 'Not moved: the job leaves it as it is carried.';
    };
    editor.addEventListener('change', show);
    return { show, start, kind, panel: element('section', { class: 'panel' }, element('h2', {}, 'Hairline'), element('div', { class: 'row' }, start), tools) };
}

export async function retargetPage(main, id) {
    const { name, back, ...about } = await subjectOf(id);
    const picture = element('div', { class: 'picture' }), work = element('aside', { class: 'work', 'aria-label': 'Work' });
    const form = await retargetForm({ ...about, changed: () => changed().catch(notice) });
    main.replaceChildren(element('div', { class: 'studio' }, picture, work));
    by_id('trail').replaceChildren(element('a', { href: back }, name), element('span', {}, ' → another head'));
    const viewer = new Viewer(picture), editor = new HairlineEditor(viewer), target = new Target(viewer, editor);
    viewer.canvas.setAttribute('aria-label', 'The other head and its hairline. Drag to turn, wheel to come closer, 1 to 4 for the views; [ and ] pick a handle of the hairline, arrows move it.');
    const hairline = hairlinePanel(editor, () => target.hairline(form.given(), form.target.value));
    const start = action('Carry it over', async () => {
        if (!form.valid()) return;
        const line = editor.handles.length && editor.moved ? { kind: hairline.kind.value, points: editor.points.map(rounded) } : null;
        const { json } = await call('POST', '/v1/jobs', { body: form.body(line) });
        kept.set(id, { source: form.source.value, target: form.target.value, line: line && { handles: editor.handles, moved: true, kind: line.kind } });
        location.hash = `#/jobs/${json.id}`;
    });
    const changed = async () => {
        start.disabled = hairline.start.disabled = !(form.source.value && form.target.value);
        editor.close();
        hairline.show();
        if (form.target.value) await target.show(form.target.value);
    };
    work.append(...form.parts.filter(Boolean), hairline.panel, element('div', { class: 'row' }, start));
    const last = kept.get(id);
    if (last) {
        form.source.value = last.source;
        form.target.value = last.target;
    }
    await changed();
    if (last?.line && form.target.value === last.target) {
        await target.hairline(form.given(), last.target);
        editor.restore(last.line);
        hairline.kind.value = last.line.kind;
    }
    say('');
    window.studio = { viewer, editor }; /* for those who look inside, tests among them */
    return () => viewer.dispose();
}
