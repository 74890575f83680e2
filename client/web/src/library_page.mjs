/* What there is: uploads to fit, jobs under way, grooms to open. */
import { call, get, picture } from './api.mjs';
import { action, ago, element, notice, say, whole } from './dom.mjs';
import { UNITS, unitHint } from './unit_hint.mjs';
import { giveUp, unfinished, upload } from './uploads.mjs';

/* A mesh has faces: at an OBJ's end, in a PLY's header. Everything else is for the daemon to tell. */
async function isHead(file) {
    if (/\.obj$/i.test(file.name)) return /^f\s/m.test(await file.slice(-65536).text());
    return /\.ply$/i.test(file.name) && /^element\s+face/m.test(await file.slice(0, 8192).text());
}

function uploadForm(refresh) {
    const unit = element('select', { name: 'unit' }, Object.entries(UNITS).map(([value, text]) => element('option', { value }, text)));
    const up = element('select', { name: 'up' }, element('option', { value: 'y' }, 'y up'), element('option', { value: 'z' }, 'z up'));
    const input = element('input', { type: 'file', multiple: true, id: 'files', onchange: () => take([...input.files]) });
    const bar = element('progress', { max: 1, value: 0, hidden: true, 'aria-label': 'Upload' });
    const box = element('section', { class: 'drop panel' }, element('h2', {}, 'Upload'),
        element('p', {}, 'Drop strands (HAIR, .data, PLY, OBJ, .tfx, .npy, .npz, JSON) and a head (OBJ or PLY mesh) here, or ',
            element('label', { for: 'files', class: 'link' }, 'choose files'), '.'), input,
        element('div', { class: 'row' }, element('label', {}, 'unit', unit), element('label', {}, 'up axis', up)), bar);
    const words = element('p', { role: 'status', class: 'hint' }), begun = element('ul', { class: 'rows' });
    box.append(words, begun);
    const send = async (file) => {
        const query = new URLSearchParams({ unit: unit.value, up: up.value, name: file.name });
        return upload(await isHead(file) ? 'heads' : 'strands', query, file, (done, what) => {
            bar.value = done;
            words.textContent = `${file.name}: ${Math.round(100 * done)} %${what ? `, ${what}` : ''}`;
        });
    };
    const showBegun = async () => begun.replaceChildren(...(await unfinished()).map((one) => element('li', {},
        element('span', {}, `${one.name}: ${Math.round((100 * one.offset) / one.length)} % has arrived. Choose the file again to go on.`),
        action('give up', () => giveUp(one).then(showBegun), { 'aria-label': `give up ${one.name}` }))));
    showBegun().catch(() => {});
    const take = async (files) => {
        const told = [];
        bar.hidden = false;
        for (const file of files) {
            try {
                const made = await send(file);
                told.push(`${file.name}: ${made.id.startsWith('head_') ? 'a head' : `${whole(made.strands)} strands`}.${unitHint(made)}`);
                say(told.join(' '));
            } catch (error) { notice(error); }
        }
        bar.hidden = true;
        words.textContent = '';
        input.value = '';
        showBegun().catch(() => {});
        refresh();
    };
    for (const name of ['dragenter', 'dragover']) box.addEventListener(name, (e) => { e.preventDefault(); box.classList.add('over'); });
    for (const name of ['dragleave', 'drop']) box.addEventListener(name, (e) => { e.preventDefault(); box.classList.remove('over'); });
    box.addEventListener('drop', (e) => take([...e.dataTransfer.files]));
    return box;
}

/* The capture's cameras: JSON as the daemon has it, NeRF's transforms.json, or COLMAP's two texts. */
async function readCameras(files, { unit, up }) {
    const texts = new Map(await Promise.all(files.map(async (file) => [file.name.toLowerCase(), await file.text()])));
    const [cameras_txt, images_txt] = ['cameras.txt', 'images.txt'].map((name) => texts.get(name));
    if (cameras_txt && images_txt) return { cameras_txt, images_txt, unit, up };
    if (cameras_txt || images_txt) throw new Error('COLMAP has two files: choose cameras.txt and images.txt together.');
    let given;
    try { given = JSON.parse([...texts.values()][0]); } catch (error) { throw new Error(`${files[0].name} is not JSON: ${error.message}`); }
    if (Array.isArray(given.cameras ?? given)) return given.cameras ?? given;
    return { ...given, unit, up };
}

function camerasInput() {
    const made = { chosen: null }, unit = element('select', { 'aria-label': 'Unit of the cameras' }, Object.keys(UNITS).map((value) => element('option', {}, value)));
    const up = element('select', { 'aria-label': 'Up axis of the cameras' }, element('option', { value: 'y' }, 'y up'), element('option', { value: 'z' }, 'z up'));
    const words = element('span', { role: 'status' });
    const take = async () => {
        made.chosen = null;
        words.textContent = '';
        if (!input.files.length) return;
        made.chosen = await readCameras([...input.files], { unit: unit.value, up: up.value });
        words.textContent = Array.isArray(made.chosen) ? `${made.chosen.length} cameras` : made.chosen.frames ? `${made.chosen.frames.length} cameras` : 'COLMAP';
    };
    const input = element('input', { type: 'file', multiple: true, accept: '.json,.txt', 'aria-label': 'Cameras for visibility', onchange: () => take().catch(notice) });
    for (const select of [unit, up]) select.addEventListener('change', () => take().catch(notice));
    made.row = element('details', {}, element('summary', {}, 'cameras of the capture'),
        element('p', { class: 'hint' }, 'Strands that no camera sees stay out of the fit. JSON, transforms.json, or COLMAP’s cameras.txt and images.txt.'),
        element('div', { class: 'row' }, input, unit, up, words));
    return made;
}

function strandsList(strands, heads) {
    const head = element('select', { 'aria-label': 'Head for the fit' }, element('option', { value: '' }, 'no head'),
        heads.map((h) => element('option', { value: h.id }, h.name || h.id)));
    if (heads.length) head.value = heads[0].id;
    const quality = element('select', { 'aria-label': 'Quality' }, ['draft', 'standard', 'high'].map((q) => element('option', { selected: q === 'standard' }, q)));
    const cameras = camerasInput();
    const fit = async (id) => {
        const options = { quality: quality.value, ...(cameras.chosen && { visibility: { cameras: cameras.chosen } }) };
        const { json } = await call('POST', '/v1/jobs', { body: { kind: 'fit', strands: id, ...(head.value && { head: head.value }), options } });
        location.hash = `#/jobs/${json.id}`;
    };
    return element('section', { class: 'panel' }, element('h2', {}, 'Strands'),
        strands.length ? [element('div', { class: 'row' }, 'Fit with', head, quality), cameras.row] : element('p', {}, 'None yet.'),
        element('ul', { class: 'rows' }, strands.map((s) => element('li', {}, element('span', {}, element('b', {}, s.name || s.id),
            ` ${whole(s.strands)} strands, ${ago(s.created_at)}`), element('span', { class: 'row' }, element('a', { class: 'button', href: `#/retarget/${s.id}`, 'aria-label': `carry ${s.name || s.id} to another head` }, 'to another head'),
                action('fit', () => fit(s.id), { 'aria-label': `fit ${s.name || s.id}` }))))));
}

const jobsList = (jobs) => element('section', { class: 'panel' }, element('h2', {}, 'Jobs'),
    jobs.length ? null : element('p', {}, 'None yet.'),
    element('ul', { class: 'rows' }, jobs.map((job) => element('li', { class: job.state },
        element('a', { href: `#/jobs/${job.id}` }, `${job.kind}, ${ago(job.created_at)}`),
        element('span', {}, job.state === 'running' ? job.stage?.name ?? '' : job.state),
        element('progress', { max: 1, value: job.progress, 'aria-label': `Progress of ${job.id}` })))));

const groomsList = (grooms) => element('section', { class: 'grooms' }, element('h2', {}, 'Grooms'),
    grooms.length ? null : element('p', {}, 'None yet. Upload strands and fit them; ', element('code', {}, 'groomctl sample'), ' makes some.'),
    element('ul', {}, grooms.map((groom) => element('li', {}, element('a', { href: `#/grooms/${groom.id}` },
        picture(`/v1/grooms/${groom.id}/preview.png?size=256&revision=${groom.revision}`, { alt: '', width: 256, height: 256, loading: 'lazy' }),
        element('b', {}, groom.name || groom.id), element('span', {}, `revision ${groom.revision}, ${ago(groom.changed_at)}`))))));

export async function libraryPage(main) {
    const refresh = async () => {
        const [{ strands }, { heads }, { jobs }, { grooms }] = await Promise.all(
            ['/v1/strands?limit=30', '/v1/heads?limit=30', '/v1/jobs?limit=20', '/v1/grooms?limit=60'].map(get));
        lists.replaceChildren(groomsList(grooms), strandsList(strands, heads), jobsList(jobs));
    };
    const lists = element('div', { class: 'lists' });
    main.replaceChildren(element('div', { class: 'library' }, uploadForm(() => refresh().catch(notice)), lists));
    say('');
    await refresh();
    return () => {};
}
