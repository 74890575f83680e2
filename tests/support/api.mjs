// What the API tests share: calls whose every answer is checked against proto/openapi.yaml, small
// files to upload, and a daemon whose jobs are the test's to run.
import { writeFileSync, existsSync, readFileSync, rmSync, chmodSync, mkdtempSync } from 'node:fs';
import net from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import assert from 'node:assert/strict';
import { build, startDaemon, until } from './daemon.mjs';
import { check_answer } from './openapi.mjs';

/** One call: { status, headers, bytes, text, json }. Options: headers, body (object: JSON), token. */
export async function call(daemon, method, target, { headers = {}, body, token, ...rest } = {}) {
  const sent = { ...headers };
  const has_type = Object.keys(sent).some((name) => name.toLowerCase() === 'content-type');
  if (token) sent.Authorization = `Bearer ${token}`;
  if (body !== undefined && typeof body !== 'string' && !(body instanceof Uint8Array) && !(body instanceof ReadableStream)) {
    body = JSON.stringify(body);
    if (!has_type) sent['Content-Type'] = 'application/json';
  } else if (body !== undefined && !has_type) sent['Content-Type'] = 'application/octet-stream';
  const response = await daemon.fetch(target, { method, headers: sent, body, redirect: 'manual', ...rest });
  const bytes = Buffer.from(await response.arrayBuffer());
  check_answer(method, new URL(target, daemon.url).pathname, response.status, response.headers, bytes);
  const text = bytes.toString();
  const json = /json/.test(response.headers.get('content-type') ?? '') && text ? JSON.parse(text) : undefined;
  return { status: response.status, headers: response.headers, bytes, text, json };
}

/** The same with the status that is expected; failures show the answer. */
export async function expect(daemon, status, method, target, options) {
  const answer = await call(daemon, method, target, options);
  assert.equal(answer.status, status, `${method} ${target}: ${answer.text.slice(0, 1000)}`);
  return answer;
}

/** A refusal: status, name of the problem, and what its members must match. */
export async function refused(daemon, status, name, method, target, { problem = {}, ...options } = {}) {
  const { json, headers } = await expect(daemon, status, method, target, options);
  assert.equal(json.type, `/problems/${name}`, JSON.stringify(json));
  for (const [key, wanted] of Object.entries(problem))
    if (wanted instanceof RegExp) assert.match(String(json[key]), wanted, JSON.stringify(json));
    else assert.equal(json[key], wanted, JSON.stringify(json));
  return { json, headers };
}

// --- files ------------------------------------------------------------------------------------

/** Points of strands that hang from a disc, [strand][vertex][3]; deterministic. */
export function points(n_strands, n_vertices, length = 0.2) {
  return Array.from({ length: n_strands }, (_, i) => {
    const angle = i * 2.399963, radius = 0.1 * Math.sqrt((i + 0.5) / n_strands);
    return Array.from({ length: n_vertices }, (_unused, j) =>
      [radius * Math.cos(angle) + 0.01 * Math.sin(j), 1.7 - (length * j) / (n_vertices - 1), radius * Math.sin(angle)].map(Math.fround));
  });
}

export const strands_json = (strands) => JSON.stringify({ strands });

/** Cem Yuksel HAIR. */
export function hair(n_strands, n_vertices, fill = points(n_strands, n_vertices)) {
  const bytes = Buffer.alloc(128 + n_strands * n_vertices * 12);
  bytes.write('HAIR', 0, 'latin1');
  bytes.writeUInt32LE(n_strands, 4);
  bytes.writeUInt32LE(n_strands * n_vertices, 8);
  bytes.writeUInt32LE(2, 12);
  bytes.writeUInt32LE(n_vertices - 1, 16);
  let at = 128;
  for (const strand of fill) for (const point of strand) for (const x of point) at = bytes.writeFloatLE(x, at);
  return bytes;
}

export const head_obj = () => {
  const lines = [];
  const n = 8;
  for (let i = 0; i <= n; i++) for (let j = 0; j < 2 * n; j++) {
    const polar = (Math.PI * i) / n, azimuth = (Math.PI * j) / n;
    lines.push(`v ${0.1 * Math.sin(polar) * Math.cos(azimuth)} ${1.6 + 0.1 * Math.cos(polar)} ${0.1 * Math.sin(polar) * Math.sin(azimuth)}`);
  }
  for (let i = 0; i < n; i++) for (let j = 0; j < 2 * n; j++) {
    const a = i * 2 * n + j + 1, b = i * 2 * n + ((j + 1) % (2 * n)) + 1;
    lines.push(`f ${a} ${b} ${b + 2 * n} ${a + 2 * n}`);
  }
  return lines.join('\n') + '\n';
};

export const array = (dtype, shape, values) => {
  const typed = dtype === 'f32' ? Float32Array.from(values) : Uint32Array.from(values);
  return { dtype, shape, data: Buffer.from(typed.buffer).toString('base64') };
};
export const decode = ({ dtype, data }) => {
  const bytes = Buffer.from(data, 'base64');
  const copy = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  return dtype === 'f32' ? new Float32Array(copy) : new Uint32Array(copy);
};

/** A small groom document that can be imported. */
export function groom_document({ n = 24, m = 12, guides = 4, k = 2, name = 'small', operators } = {}) {
  const shapes = points(guides, m);
  const uv = (i, of) => [(i + 0.5) / of, 0.5];
  return {
    format: 'groom/1', unit: 'm', name, source: {},
    strands: {
      count: n, vertices: m, roots: array('f32', [n, 3], points(n, 2).flatMap((strand) => strand[0])),
      root_uv: array('f32', [n, 2], Array.from({ length: n }, (_, i) => uv(i, n)).flat()),
    },
    guides: {
      count: guides, vertices: m, points: array('f32', [guides, m, 3], shapes.flat(2)),
      root_uv: array('f32', [guides, 2], Array.from({ length: guides }, (_, i) => uv(i, guides)).flat()),
    },
    instancing: {
      guide: array('u32', [n, k], Array.from({ length: n * k }, (_, i) => (Math.floor(i / k) + (i % k)) % guides)),
      weight: array('f32', [n, k], Array.from({ length: n * k }, (_, i) => (i % k ? 0.25 / (k - 1) : 0.75))),
    },
    operator_guides: { guide: array('u32', [2], [0, 2]), of_strand: array('u32', [n], Array.from({ length: n }, (_, i) => i % 2)) },
    operators: operators ?? [
      { type: 'scale', random_scale: 0.1, seed: 7 },
      { type: 'curl', radius: 0.004, frequency: 20, random_frequency: 0, start: 0.1, seed: 7 },
      { type: 'frizz', frequency: 300, amplitude: 0.001, seed: 7 },
    ],
  };
}

// --- jobs that the test runs itself --------------------------------------------------------------

/** A daemon whose attempts only write down their token; everything else is the real groom-worker. */
export async function startIdleDaemon(t, options = {}) {
  const folder = mkdtempSync(join(tmpdir(), 'groomd-idle-'));
  const script = join(folder, 'worker'), file = join(folder, 'attempt');
  writeFileSync(script, `#!/bin/sh
if [ "$1" = attempt ]; then
  printf '%s' "$GROOM_WORK_TOKEN" >'${file}.part' && /bin/mv '${file}.part' '${file}'
  exec /bin/sleep 600
fi
exec '${join(build, 'groom-worker')}' "$@"
`);
  chmodSync(script, 0o755);
  const daemon = await startDaemon(t, { ...options, args: ['--worker', script, ...(options.args ?? [])] });
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  /** The token of the attempt that was launched last. */
  daemon.attempt = async () => {
    await until('an attempt is launched', () => existsSync(file));
    const token = readFileSync(file, 'utf8');
    rmSync(file);
    return token;
  };
  return daemon;
}

export async function upload(daemon, n_strands = 20, n_vertices = 10) {
  return (await call(daemon, 'POST', '/v1/strands', { body: hair(n_strands, n_vertices) })).json;
}

/** A queued job on fresh strands. */
export async function submit(daemon, options = {}, headers = {}) {
  const strands = await upload(daemon);
  return (await expect(daemon, 202, 'POST', '/v1/jobs', { headers, body: { kind: 'fit', strands: strands.id, ...options } })).json;
}

// --- event streams -----------------------------------------------------------------------------

/** Reads server-sent events until the stream ends or `stop` says so: [{ id, event, data }]. */
export async function events(daemon, target, { headers = {}, stop = () => false } = {}) {
  const abort = new AbortController();
  const response = await daemon.fetch(target, { headers, signal: abort.signal });
  assert.equal(response.status, 200);
  assert.equal(response.headers.get('content-type'), 'text/event-stream');
  const found = [];
  let text = '';
  try {
    for await (const piece of response.body) {
      text += Buffer.from(piece).toString();
      for (let end; (end = text.indexOf('\n\n')) >= 0; text = text.slice(end + 2)) {
        const fields = Object.fromEntries(text.slice(0, end).split('\n').filter((line) => line && line[0] !== ':')
          .map((line) => [line.slice(0, line.indexOf(':')), line.slice(line.indexOf(':') + 1).trim()]));
        if (fields.data) found.push({ id: Number(fields.id), event: fields.event, data: JSON.parse(fields.data) });
        if (stop(found)) return found;
      }
    }
  } finally {
    abort.abort();
  }
  return found;
}

// --- raw bytes -----------------------------------------------------------------------------------

/** What comes back for these very bytes, until the other side closes or `ms` have passed. */
export function raw(daemon, bytes, ms = 3000) {
  const { hostname, port } = new URL(daemon.url);
  return new Promise((done) => {
    const socket = net.connect(Number(port), hostname, () => socket.write(bytes));
    const pieces = [];
    const end = () => { socket.destroy(); clearTimeout(late); done(Buffer.concat(pieces).toString('latin1')); };
    const late = setTimeout(end, ms);
    socket.on('data', (piece) => pieces.push(piece)).on('end', end).on('error', end).on('close', end);
  });
}
