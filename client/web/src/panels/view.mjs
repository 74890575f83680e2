/* What the picture shows: where from, beside what, how densely, coloured by what. */
import { get } from '../api.mjs';
import { COLOURS, colourBy, coloursOf } from '../colours.mjs';
import { element, notice } from '../dom.mjs';
import { arrayOf, fetchStrands } from '../strands.mjs';
import { COMPARISONS, VIEWS } from '../viewer/viewer.mjs';

const COLOUR_AFTER_MS = 300;

function showGuides(viewer, document, on) {
    if (!on || !document.guides) { viewer.setGuides({ points: [], count: 0, vertices: 0 }); return; }
    const operator_guides = new Set(arrayOf(document.operator_guides.guide));
    viewer.setGuides({ ...document.guides, points: arrayOf(document.guides.points) }, operator_guides);
}

/* The target, or another revision, beside the groom. */
class Against {
    constructor(session, viewer, shine) { Object.assign(this, { session, viewer, shine, revision: null, matched: false }); }

    /* returns  whether there is anything to compare with */
    async load() {
        const { session, revision } = this, { source, strands: { count: n, vertices } } = session.document;
        if (revision !== null) {
            this.strands = await session.strandsOf(revision);
            this.matched = this.strands.vertices === vertices;
        } else if (source?.strands) {
            const { strands: held } = await get(`/v1/strands/${source.strands}`);
            this.matched = held === n; /* strand for strand; a fit that left some out has others in their place */
            this.strands = await fetchStrands(source.strands, Math.min(session.count, held), vertices, this.matched ? session.slotOf : undefined);
        } else return false;
        this.viewer.show(this.viewer.target, this.strands);
        await this.shine(this.viewer.target, this.strands);
        return true;
    }
}

const legend = () => element('figure', { class: 'legend', hidden: true }, element('div', { class: 'ramp' }), element('figcaption', {}));

function showLegend(box, colours) {
    box.hidden = !colours;
    if (!colours) return;
    box.firstChild.style.background = `linear-gradient(to right, ${colours.anchors.join(',')})`;
    box.lastChild.replaceChildren(...colours.labels.map((text) => element('span', {}, text)));
}

/* Colours follow the strands: at once against the target, after a rest where the daemon analyses a revision. */
function colourControl(session, viewer, evaluation, against) {
    const box = legend();
    const select = element('select', { onchange: () => paint().catch(notice) },
        coloursOf(session.document).map(([value, { label }]) => element('option', { value }, label)));
    const paint = async () => {
        const name = select.value;
        if (name === 'none') { viewer.groom.colour(null); showLegend(box, null); viewer.draw(); return; }
        const { count, document: { strands } } = session;
        if (COLOURS[name].target && (!against.matched || against.strands?.count !== count)) throw new Error('There is no target with the same strands to measure against.');
        const colours = await colourBy(name, { session, strands: evaluation.strands, target: against.strands, slotOf: session.slotOf });
        if (select.value !== name || colours.values.length !== evaluation.strands.count * strands.vertices) return; /* overtaken */
        viewer.groom.colour(colours);
        showLegend(box, colours);
        viewer.draw();
    };
    let soon;
    const later = () => {
        if (select.value === 'none') return;
        clearTimeout(soon);
        soon = setTimeout(() => paint().catch(notice), COLOURS[select.value].target ? 0 : COLOUR_AFTER_MS);
    };
    evaluation.addEventListener('shown', () => COLOURS[select.value].target && later());
    session.addEventListener('revision', later);
    session.addEventListener('chosen', later);
    return { rows: [element('label', {}, 'colour by', select), box], select, paint };
}

/* The cameras that a fit was told of, as frusta. */
async function cameraControl(session, viewer) {
    const { job } = session.document.source ?? {};
    const cameras = job ? (await get(`/v1/jobs/${job}`).catch(() => null))?.options?.visibility?.cameras : null;
    if (!Array.isArray(cameras) || !cameras.length) return null;
    const box = element('input', { type: 'checkbox', onchange: () => viewer.setCameras(box.checked ? cameras : []) });
    return element('label', {}, box, `the capture’s ${cameras.length} cameras`);
}

export function viewPanel(parent, { session, viewer, evaluation, editor, shine }) {
    const looks = Object.keys(VIEWS).map((name, i) => element('button', { type: 'button', onclick: () => viewer.look(name), title: `Key ${i + 1}` }, name));
    const against = new Against(session, viewer, shine);
    const choose = (comparison) => {
        compare.value = viewer.comparison = comparison;
        wipe.hidden = comparison !== 'wipe';
        viewer.draw();
    };
    const compare = element('select', { onchange: () => choose(compare.value) }, COMPARISONS.map((name) => element('option', {}, name)));
    const wipe = element('input', { type: 'range', min: 0, max: 1, step: 0.01, value: 0.5, hidden: true, 'aria-label': 'Where the wipe stands',
        oninput: () => { viewer.wipe = Number(wipe.value); viewer.draw(); } });
    const with_what = element('span', { role: 'status' }), back = element('button', { type: 'button', class: 'small', hidden: true, onclick: () => session.compareWith(null) }, 'the target again');
    const density = element('input', { type: 'range', min: 100, max: session.document.strands.count, value: session.count,
        onchange: () => session.choose(Number(density.value)).catch(notice) });
    const guides = element('input', { type: 'checkbox', onchange: () => {
        showGuides(viewer, session.document, guides.checked);
        editor.enable(guides.checked);
    } });
    const comparing = element('div', { hidden: true }, element('label', {}, 'compare', compare), wipe, element('p', { class: 'hint' }, with_what, ' ', back));
    const colours = colourControl(session, viewer, evaluation, against);
    const reload = async () => {
        const found = await against.load();
        comparing.hidden = !found;
        with_what.textContent = against.revision === null ? 'with the target' : `with revision ${against.revision}`;
        back.hidden = against.revision === null || !session.document.source?.strands;
    };
    session.addEventListener('document', () => guides.checked && showGuides(viewer, session.document, true));
    session.addEventListener('chosen', () => reload().catch(notice));
    session.addEventListener('against', ({ detail: { revision } }) => {
        against.revision = revision;
        reload().then(() => { if (revision !== null && viewer.comparison === 'groom') choose('side by side'); }).catch(notice);
    });
    const panel = element('section', { class: 'panel' }, element('h2', {}, 'View'), element('div', { class: 'row' }, looks), comparing,
        element('label', {}, 'density', density), colours.rows,
        element('label', { title: 'Without a mouse, in the picture: [ and ] pick one, − and + a point of it, arrows move that' }, guides, 'guides: click one, drag its points; operator guides in orange'));
    parent.append(panel);
    cameraControl(session, viewer).then((control) => control && panel.append(control)).catch(notice);
    return { reload, colours };
}
