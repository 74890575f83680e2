/* The daemon's calls. A refusal is thrown as its problem document (RFC 9457). */
import { tell } from './commands.mjs';

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

/* { json, etag, response } */
export async function call(method, path, { body, headers = {}, type = 'application/json' } = {}) {
    const plain = body === undefined || typeof body === 'string' || body instanceof Blob;
    const response = await fetch(path, {
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
    const response = await fetch(path);
    if (!response.ok) await refuse(response);
    return response.arrayBuffer();
}

/* An upload with progress (0..1): fetch cannot tell it. */
export function upload(path, file, on_progress) {
    return new Promise((resolve, reject) => {
        const request = new XMLHttpRequest();
        request.open('POST', path);
        request.upload.onprogress = (e) => e.lengthComputable && on_progress(e.loaded / e.total);
        request.onerror = () => reject(new Error(`the connection broke while ${file.name} was sent`));
        request.onload = () => {
            let json = {};
            try { json = JSON.parse(request.responseText); } catch { /* told below */ }
            if (request.status < 300) { tell({ method: 'POST', path, file: file.name, answer: json }); resolve(json); }
            else reject(new Problem(request.status, json));
        };
        request.send(file);
    });
}

/* A job's events until it ends; returns a function that stops listening. */
export function follow(job, on) {
    const source = new EventSource(`/v1/jobs/${job}/events`);
    for (const name of ['stage', 'progress', 'loss', 'state'])
        source.addEventListener(name, (event) => {
            const data = JSON.parse(event.data);
            on(name, data);
            if (name === 'state' && ['succeeded', 'failed', 'cancelled'].includes(data.state)) source.close();
        });
    return () => source.close();
}
