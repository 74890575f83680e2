/* One groom: the picture on the left, the work on the right. */
import { EngineThread } from './engine_thread.mjs';
import { by_id, element, notice, say, whole } from './dom.mjs';
import { GuideEditor } from './guide_editor.mjs';
import { Session } from './session.mjs';
import { arrayOf, fetchHead, fetchStrands } from './strands.mjs';
import { exportPanel } from './panels/export.mjs';
import { picturePanel } from './panels/picture.mjs';
import { historyPanel } from './panels/history.mjs';
import { operatorsPanel } from './panels/operators.mjs';
import { sculptPanel } from './panels/sculpt.mjs';
import { Hair, boxOf } from './viewer/hair.mjs';
import { COMPARISONS, VIEWS, Viewer } from './viewer/viewer.mjs';

const AT_FIRST = 10000, LIGHT_CELLS = 64, LIGHT_AFTER_MS = 250;

/* Strands come as fast as the engine makes them; what piles up while one evaluation runs is one request. */
class Evaluation {
    constructor(session, viewer) {
        Object.assign(this, { session, viewer, running: false, again: false });
        session.addEventListener('strands', () => this.request().catch(notice));
        session.addEventListener('attempt', () => this.#attempt());
    }

    /* Strands of an attempt in place of their own, until the next evaluation. */
    #attempt() {
        const { vertices } = this.strands;
        for (const { slot, points } of this.session.attempt) this.strands.points.set(points, 3 + 3 * slot * vertices);
        this.viewer.show(this.viewer.groom, this.strands);
    }

    async request() {
        if (this.running) { this.again = true; return; }
        this.running = true;
        try {
            do {
                this.again = false;
                this.strands = await this.session.strands();
                this.viewer.show(this.viewer.groom, this.strands);
                say(`${whole(this.strands.count)} of ${whole(this.session.document.strands.count)} strands, ${this.strands.ms.toFixed(0)} ms`);
            } while (this.again);
        } finally { this.running = false; }
        clearTimeout(this.soon);
        this.soon = setTimeout(() => this.light().catch(notice), this.lit ? LIGHT_AFTER_MS : 0);
    }

    async light() {
        await shine(this.viewer, this.viewer.groom, this.session.thread, this.session.remote ? this.strands : undefined);
        this.lit = true;
    }
}

/* Shadows: of the strands given, or of those that the engine has. */
async function shine(viewer, hair, thread, strands) {
    const width = Hair.widthOf(viewer.diagonal, hair.count);
    hair.shine(await thread.call('light', { strands, cells: LIGHT_CELLS, width, key: Viewer.KEY.toArray() }));
    viewer.draw();
}

async function showTarget(viewer, { document, count: most, thread }) {
    const id = document.source?.strands;
    if (!id) return false;
    const count = Math.min(document.strands.count, most);
    const strands = await fetchStrands(id, count, Math.min(document.strands.vertices, 64));
    viewer.show(viewer.target, strands);
    await shine(viewer, viewer.target, thread, strands);
    return true;
}

function showGuides(viewer, document, on) {
    if (!on || !document.guides) { viewer.setGuides({ points: [], count: 0, vertices: 0 }); return; }
    const operator_guides = new Set(arrayOf(document.operator_guides.guide));
    viewer.setGuides({ ...document.guides, points: arrayOf(document.guides.points) }, operator_guides);
}

function viewPanel(parent, session, viewer, editor) {
    const looks = Object.keys(VIEWS).map((name, i) => element('button', { type: 'button', onclick: () => viewer.look(name), title: `Key ${i + 1}` }, name));
    const compare = element('select', { onchange: () => { viewer.comparison = compare.value; wipe.hidden = compare.value !== 'wipe'; viewer.draw(); } },
        COMPARISONS.map((name) => element('option', {}, name)));
    const wipe = element('input', { type: 'range', min: 0, max: 1, step: 0.01, value: 0.5, hidden: true, 'aria-label': 'Where the wipe stands',
        oninput: () => { viewer.wipe = Number(wipe.value); viewer.draw(); } });
    const density = element('input', { type: 'range', min: 100, max: session.document.strands.count, value: session.count,
        onchange: () => session.choose(Number(density.value)).catch(notice) });
    const guides = element('input', { type: 'checkbox', onchange: () => {
        showGuides(viewer, session.document, guides.checked);
        editor.enable(guides.checked);
    } });
    const comparing = element('label', { hidden: true }, 'compare', compare);
    session.addEventListener('document', () => guides.checked && showGuides(viewer, session.document, true));
    parent.append(element('section', { class: 'panel' }, element('h2', {}, 'View'),
        element('div', { class: 'row' }, looks), comparing, wipe, element('label', {}, 'density', density),
        element('label', {}, guides, 'guides: click one, drag its points; operator guides in orange')));
    return comparing;
}

/* strands: how many to show at first (#/grooms/ID?strands=N) */
export async function groomPage(main, id, strands = AT_FIRST) {
    const thread = new EngineThread(), session = new Session(id, thread);
    say('Opening …');
    const { types } = await session.open(Number(strands));
    const picture = element('div', { class: 'picture' }), work = element('aside', { class: 'work', 'aria-label': 'Work' });
    main.replaceChildren(element('div', { class: 'studio' }, picture, work));
    by_id('trail').replaceChildren(element('a', { href: `#/grooms/${id}` }, session.document.name || id));
    const viewer = new Viewer(picture), evaluation = new Evaluation(session, viewer);
    const editor = new GuideEditor(viewer, session), comparing = viewPanel(work, session, viewer, editor), chain = element('div', { class: 'chain' });
    work.append(chain);
    operatorsPanel(chain, session, types);
    const armature = sculptPanel(work, session, viewer);
    historyPanel(work, session);
    exportPanel(work, session);
    picturePanel(work, session, viewer);
    await evaluation.request();
    viewer.frame(boxOf(evaluation.strands));
    viewer.look('front');
    const { head } = session.document.source ?? {};
    if (head) fetchHead(head).then((geometry) => viewer.setHead(geometry)).catch(notice);
    showTarget(viewer, session).then((shown) => { comparing.hidden = !shown; }).catch(notice);
    window.studio = { viewer, session, evaluation, editor, armature }; /* for those who look inside, tests among them */
    return () => { viewer.dispose(); thread.close(); };
}
