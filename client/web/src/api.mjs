/* The daemon's calls. A refusal is thrown as its problem document (RFC 9457). */
import { ask, authorized, token } from './access.mjs';
import { tell } from './commands.mjs';
import { element } from './dom.mjs';
import { listen } from './event_stream.mjs';

export class Problem extends Error {
    constructor(status, problem) {
        super(problem.detail ?? problem.title ?? `the server answered ${status}`);
        Object.assign(this, problem, { status });
    }
}

async function refuse(response) {
    const text = await response.text();
    let problem = {};
    try { problem = JSON.parse(text); } catch { problem = { detail: text.slice(0, 300) }; }
    throw new Problem(response.status, problem);
}

/* fetch, with the token where there is one; a call that is refused for want of one waits until it is entered. */
async function request(path, { headers = {}, ...rest } = {}) {
    for (;;) {
        const held = token(), response = await fetch(path, { ...rest, headers: authorized(headers) });
        if (response.status !== 401) return response;
        const problem = await response.clone().json().catch(() => ({}));
        if (!await ask(held, problem.detail ?? '')) return response;
    }
}

/* { json, etag, response } */
export async function call(method, path, { body, headers = {}, type = 'application/json' } = {}) {
    const plain = body === undefined || typeof body === 'string' || body instanceof Blob;
    const response = await request(path, {
        method, body: plain ? body : JSON.stringify(body),
        headers: body === undefined ? headers : { 'Content-Type': type, ...headers },
    });
    if (!response.ok) await refuse(response);
    const json = /json/.test(response.headers.get('content-type') ?? '') ? await response.json() : undefined;
    if (method !== 'GET') tell({ method, path, body, headers, type, answer: json });
    return { json, etag: response.headers.get('etag'), response };
}

export const get = async (path) => (await call('GET', path)).json;

export async function bytes(path) {
    const response = await request(path);
    if (!response.ok) await refuse(response);
    return response.arrayBuffer();
}

/* A file that the daemon sends: { bytes, type, name }. */
export async function file(path) {
    const response = await request(path);
    if (!response.ok) await refuse(response);
    const name = /filename="([^"]+)"/.exec(response.headers.get('content-disposition') ?? '')?.[1];
    return { bytes: await response.arrayBuffer(), type: response.headers.get('content-type'), name };
}

/* An <img> of what the daemon draws. */
export function picture(path, attributes) {
    const image = element('img', { ...attributes, ...(!token() && { src: path }) });
    if (token()) file(path).then(({ bytes: made, type }) => { image.src = URL.createObjectURL(new Blob([made], { type })); }, () => {});
    return image;
}

/* Bytes with progress (bytes that have gone out), which fetch cannot tell: { status, text, header(name) }. */
export async function send(method, path, body, headers, on_progress) {
    for (;;) {
        const held = token(), answer = await attempt(method, path, body, authorized(headers), on_progress);
        if (answer.status !== 401 || !await ask(held, 'The upload needs it.')) return answer;
    }
}

function attempt(method, path, body, headers, on_progress) {
    return new Promise((resolve, reject) => {
        const sent = new XMLHttpRequest();
        sent.open(method, path);
        for (const [name, value] of Object.entries(headers)) sent.setRequestHeader(name, value);
        sent.upload.onprogress = (event) => on_progress?.(event.loaded);
        sent.onerror = () => reject(new TypeError('the connection broke'));
        sent.onload = () => resolve({ status: sent.status, text: sent.responseText, header: (name) => sent.getResponseHeader(name) });
        sent.send(body);
    });
}

/* What a call answered in JSON, or its problem. */
export function answered({ status, text }) {
    let json = {};
    try { json = JSON.parse(text); } catch { json = { detail: text.slice(0, 300) }; }
    if (status >= 300) throw new Problem(status, json);
    return json;
}

const ENDS = ['succeeded', 'failed', 'cancelled'];

/* A job's events until it ends; returns a function that stops listening. */
export function follow(job, on) {
    const stop = new AbortController();
    listen(`/v1/jobs/${job}/events`, request, stop.signal, (name, data) => {
        on(name, data);
        if (name === 'state' && ENDS.includes(data.state)) stop.abort();
    });
    return () => stop.abort();
}
