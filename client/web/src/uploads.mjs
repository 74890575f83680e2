/* Files to the daemon. Large ones go up in pieces (tus 1.0): what has arrived is on its disk, and a broken
 * line, or a page that was closed, costs only what was under way. */
import { answered, get, send } from './api.mjs';
import { tell } from './commands.mjs';

export const LARGE = 4 << 20; /* bytes, from which on a file goes in pieces */
const PIECE = 8 << 20, AGAIN_MS = [500, 1000, 2000, 4000, 8000, 16000];
const PREFIX = 'groomd-upload:', VERSION = { 'Tus-Resumable': '1.0.0' };

const wait = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });

/* A file is known again by these; its bytes are the server's to check. */
const keyOf = (file) => `${PREFIX}${file.name}:${file.size}:${file.lastModified}`;

const base64 = (text) => btoa(String.fromCharCode(...new TextEncoder().encode(text)));

/* Uploads that this browser began and did not end: [{ key, name, path, offset, length }]. */
export async function unfinished() {
    const found = [];
    for (const key of Object.keys(localStorage).filter((k) => k.startsWith(PREFIX))) {
        const path = localStorage.getItem(key), name = key.slice(PREFIX.length).replace(/:\d+:\d+$/, '');
        try {
            const { offset, length } = await get(path);
            found.push({ key, name, path, offset, length });
        } catch { localStorage.removeItem(key); } /* expired, or used */
    }
    return found;
}

export async function giveUp({ key, path }) {
    localStorage.removeItem(key);
    await send('DELETE', path, undefined, VERSION);
}

async function begin(file) {
    const made = await send('POST', '/v1/uploads', undefined, { ...VERSION, 'Upload-Length': file.size, 'Upload-Metadata': `filename ${base64(file.name)}` });
    if (made.status >= 300) answered(made);
    const path = new URL(made.header('Location'), location.href).pathname;
    localStorage.setItem(keyOf(file), path);
    return { path, offset: 0 };
}

/* Where an upload stands: the one that was begun before, or a new one. */
async function resume(file) {
    const path = localStorage.getItem(keyOf(file));
    if (!path) return begin(file);
    const held = await send('HEAD', path, undefined, VERSION);
    return held.status === 200 ? { path, offset: Number(held.header('Upload-Offset')) } : begin(file);
}

async function sendPiece(file, { path, offset }, on_progress) {
    const piece = file.slice(offset, offset + PIECE);
    const sent = await send('PATCH', path, piece, { ...VERSION, 'Upload-Offset': offset, 'Content-Type': 'application/offset+octet-stream' },
        (loaded) => on_progress((offset + loaded) / file.size));
    if (sent.status === 204) return { path, offset: Number(sent.header('Upload-Offset')) };
    if ([409, 423, 460].includes(sent.status) || sent.status >= 500) throw new TypeError('the piece did not arrive'); /* ask where it stands */
    return answered(sent);
}

/* All bytes are at the server when this returns; on_progress(0..1, words). returns the upload's path */
async function inPieces(file, on_progress) {
    let state = await resume(file);
    for (let broken = 0; state.offset < file.size;) {
        try {
            const before = state.offset;
            on_progress(before / file.size, before ? 'going on' : '');
            state = await sendPiece(file, state, (done) => on_progress(done, ''));
            if (state.offset > before) broken = 0;
        } catch (error) {
            if (!(error instanceof TypeError) || broken >= AGAIN_MS.length) throw error;
            on_progress(state.offset / file.size, 'the line broke; trying again');
            await wait(AGAIN_MS[broken++]);
            state = await resume(file).catch(() => state);
        }
    }
    return state.path;
}

/* kind: strands or heads; query: URLSearchParams. returns what the server made of it */
export async function upload(kind, query, file, on_progress) {
    const path = `/v1/${kind}?${query}`, made = file.size < LARGE
        ? answered(await send('POST', path, file, {}, (loaded) => on_progress(loaded / Math.max(1, file.size), '')))
        : await uploadPieces(path, file, on_progress);
    tell({ method: 'POST', path, file: file.name, answer: made });
    return made;
}

async function uploadPieces(path, file, on_progress) {
    const arrived = await inPieces(file, on_progress);
    on_progress(1, 'being read');
    const made = answered(await send('POST', `${path}&upload=${arrived.split('/').at(-1)}`, undefined, {}));
    localStorage.removeItem(keyOf(file));
    return made;
}
