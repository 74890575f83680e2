// Sculpting over HTTP: a lock of 2 000 strands that somebody drags, and 90 000 strands at once.
//   figure NAME VALUE UNIT words
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { performance } from 'node:perf_hooks';
import { fileURLToPath } from 'node:url';

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../..'), build = resolve(top, process.env.BUILD ?? 'build');
const figure = (name, value, unit, words) => console.log(`figure ${name} ${value.toPrecision(4)} ${unit} ${words}`);
const seconds = (from) => (performance.now() - from) / 1000;

/** Coils of 0.15 m: 5 turns of 6 to 10 mm, as HAIR and as points. */
function coils(n, m) {
  const bytes = Buffer.alloc(128 + n * m * 12);
  bytes.write('HAIR');
  for (const [at, value] of [[4, n], [8, n * m], [12, 2], [16, m - 1]]) bytes.writeUInt32LE(value, at);
  const points = new Float32Array(bytes.buffer, bytes.byteOffset + 128, n * m * 3);
  for (let i = 0, at = 0; i < n; i++) {
    const x = 0.0004 * (i % 300), z = 0.0004 * Math.floor(i / 300), wide = 0.006 + 0.004 * ((i * 0.618) % 1), turn = i * 2.4;
    for (let j = 0; j < m; j++, at += 3) {
      const s = j / (m - 1), r = wide * Math.min(1, 4 * s), a = turn + 10 * Math.PI * s;
      points[at] = x + r * Math.cos(a);
      points[at + 1] = 1.7 - 0.12 * s;
      points[at + 2] = z + r * Math.sin(a);
    }
  }
  return { bytes, points };
}

/** Processor seconds of the daemon so far, and of its children that have ended: what an edit costs,
 * whatever else the machine does. */
function processor_seconds(pid) {
  const fields = readFileSync(`/proc/${pid}/stat`, 'latin1').replace(/^.*\) /, '').split(' ');
  return [11, 13].map((at) => (Number(fields[at]) + Number(fields[at + 1])) / 100);
}
const since = (before) => processor_seconds(child.pid).map((now, i) => now - before[i]);

const array = (dtype, shape, typed) => ({ dtype, shape, data: Buffer.from(typed.buffer, typed.byteOffset, typed.byteLength).toString('base64') });
/** The tips of strands 0..k-1, moved aside. */
function anchors(points, m, k, aside) {
  const position = new Float32Array(k * 3);
  for (let i = 0; i < k; i++) {
    const tip = ((i + 1) * m - 1) * 3;
    position.set([points[tip] + aside, points[tip + 1] + 0.2 * aside, points[tip + 2]], 3 * i);
  }
  return { strand: array('u32', [k], Uint32Array.from({ length: k }, (_, i) => i)), at: array('f32', [k], new Float32Array(k).fill(1)), position: array('f32', [k, 3], position) };
}

async function start_daemon(folder) {
  const child = spawn(join(build, 'groomd'), ['--data', join(folder, 'data'), '--listen', '127.0.0.1:0', '--log-level', 'warning'], { stdio: ['ignore', 'pipe', 'inherit'] });
  const url = await new Promise((done, fail) => {
    let text = '';
    child.on('exit', () => fail(new Error('groomd ended')));
    child.stdout.on('data', (bytes) => { const found = /^listening on (\S+)\n/.exec(text += bytes); if (found) done(found[1]); });
  });
  return { child, url };
}

async function call(url, method, path, body, headers = {}) {
  const is_bytes = body instanceof Uint8Array;
  const answer = await fetch(url + path, { method, headers: { 'Content-Type': is_bytes ? 'application/octet-stream' : 'application/json', ...headers }, body: body && (is_bytes ? body : JSON.stringify(body)) });
  const json = await answer.json();
  if (!answer.ok) throw new Error(`${method} ${path}: ${JSON.stringify(json).slice(0, 600)}`);
  return { status: answer.status, json };
}
const upload = async (url, bytes) => (await call(url, 'POST', '/v1/strands', bytes)).json.id;

async function drag(url) {
  const n = 10000, m = 100, k = 2000, rounds = 40;
  const { bytes, points } = coils(n, m);
  const strands = await upload(url, bytes);
  const { groom, layer } = (await call(url, 'POST', `/v1/strands/${strands}/sculpt`, { anchors: anchors(points, m, k, 0.001), elements: 45 })).json;
  for (const [name, commit] of [['sculpt_http_2k_updates_per_s', false], ['sculpt_http_2k_commits_per_s', true]]) {
    let solved = 0;
    const bodies = Array.from({ length: rounds }, (_, i) => JSON.stringify({ layer, commit, points: true, anchors: anchors(points, m, k, 0.001 * (i + 1)) }));
    const from = performance.now(), cpu = processor_seconds(child.pid);
    for (const body of bodies) {
      const answer = await fetch(`${url}/v1/grooms/${groom}/sculpt`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body });
      const text = await answer.text();
      if (!answer.ok) throw new Error(text.slice(0, 600));
      solved += Number(/"seconds":([0-9.e-]+)/.exec(text)[1]);
    }
    const took = seconds(from);
    figure(name, rounds / took, '1/s', `a lock of ${k} of ${n} strands x 45 elements, one anchor each, points answered; ${(1000 * took / rounds).toFixed(0)} ms, ${(1000 * solved / rounds).toFixed(0)} of them the edit; ${(1000 * since(cpu)[0] / rounds).toFixed(0)} ms of the daemon's processor time`);
  }
}

async function whole_head(url) {
  const n = 90000, m = 91;
  const { bytes, points } = coils(n, m);
  const strands = await upload(url, bytes);
  const { groom, layer } = (await call(url, 'POST', `/v1/strands/${strands}/sculpt`, { anchors: anchors(points, m, 1, 0.001) })).json;
  await (await fetch(`${url}/v1/grooms/${groom}/strands?format=hair`)).arrayBuffer(); // it has been looked at
  const body = { layer, elements: 90, anchors: anchors(points, m, n, 0.02) };
  const from = performance.now(), cpu = processor_seconds(child.pid);
  const { json } = await call(url, 'POST', `/v1/grooms/${groom}/sculpt`, body);
  let job = json;
  while (job.state === 'queued' || job.state === 'running') job = (await call(url, 'GET', `/v1/jobs/${json.id}`, undefined, { Prefer: 'wait=60' })).json;
  const took = seconds(from);
  await new Promise((done) => setTimeout(done, 300)); // until the worker has ended and its time is known
  if (job.state !== 'succeeded') throw new Error(JSON.stringify(job.error));
  figure('sculpt_http_90k_seconds', took, 's', `90 000 x 90 elements, one anchor each, from request to finished job; ${job.result.seconds.toFixed(2)} s of them in the worker, processor time ${since(cpu)[0].toFixed(2)} s in the daemon and ${since(cpu)[1].toFixed(2)} s in the worker, energy ${job.result.energy.before.toPrecision(3)} -> ${job.result.energy.after.toPrecision(3)}`);
  const again = performance.now();
  const data = await (await fetch(`${url}/v1/grooms/${groom}/strands?format=hair`)).arrayBuffer();
  figure('sculpt_export_90k_seconds', seconds(again), 's', `its ${(data.byteLength / 1e6).toFixed(0)} MB as HAIR, without solving again`);
}

const folder = mkdtempSync(join(existsSync(build) ? build : tmpdir(), 'bench-layers-'));
const { child, url } = await start_daemon(folder);
try {
  await drag(url);
  await whole_head(url);
} finally {
  child.removeAllListeners('exit');
  const ended = new Promise((done) => child.on('exit', done));
  child.kill('SIGTERM');
  await ended;
  rmSync(folder, { recursive: true, force: true });
}
