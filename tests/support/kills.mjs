// A workload of uploads, fits and edits by several clients, who write down what they were told, and the
// examination afterwards: whatever was killed meanwhile, all of that must be there.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { setTimeout as sleep } from 'node:timers/promises';
import { groom_document, hair, points } from './api.mjs';

/** Seeded numbers 0..1 (mulberry32): a failure can be repeated, as far as the machine allows. */
export function random(seed) {
  let a = seed >>> 0;
  return () => {
    a = (a + 0x6d2b79f5) | 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');
// all stages, and next to no work in any
const smallest = { guides: 3, operator_guides: 2, vertices: 8, seed: 1, quality: 'draft', stages: {
  instance_weights: { iterations: 1 }, guides: { iterations: 1 }, operators: { iterations: 1, refinements: 0, pairs: 10, batches_late: 1, batches: 1 }, randoms: { iterations: 1, rounds: 1, strands: 1, values: 2 } } };
const end_states = new Set(['succeeded', 'failed', 'cancelled']);

export class Workload {
  constructor(daemon, seed) {
    Object.assign(this, { daemon, next: random(seed), seed, running: false, clients: [], uploads: [], jobs: new Map(), grooms: new Map(), events: new Map(), refusals: [], sent: 0, n_told: 0, max_waiting: Infinity, n_waiting: 0, newest: null });
  }

  /** One call; null where the line broke: then nobody was told anything. */
  async ask(method, path, { body, headers = {} } = {}) {
    this.sent++;
    try {
      const response = await this.daemon.fetch(path, { method, body, headers, signal: AbortSignal.timeout(20000) });
      const bytes = Buffer.from(await response.arrayBuffer());
      return { status: response.status, headers: response.headers, bytes, json: () => JSON.parse(bytes) };
    } catch { return null; }
  }

  /** What was answered must be one of these; 503 is an answer of a service that is just starting or ending. */
  told(answer, statuses, what) {
    if (!answer || answer.status === 503) return false;
    if (statuses.includes(answer.status)) { this.n_told++; return true; }
    this.refusals.push(`${what}: ${answer.status} ${answer.bytes.toString().slice(0, 300)}`);
    return false;
  }

  async upload(client) {
    const fill = points(8, 6, 0.1 + 0.1 * client.next());
    fill[0][0][0] = Math.fround(client.next());
    const bytes = hair(8, 6, fill);
    const answer = await this.ask('POST', '/v1/strands', { body: bytes, headers: { 'Content-Type': 'application/octet-stream' } });
    if (!this.told(answer, [200, 201], 'upload')) return;
    client.strands = answer.json().id;
    this.uploads.push({ id: client.strands, sha256: sha256(bytes) });
  }

  /** Are fewer than max_waiting jobs before the newest? A queue that grows is no steady state. */
  async has_room() {
    if (this.n_waiting < this.max_waiting) return true;
    const job = await this.ask('GET', `/v1/jobs/${this.newest}`);
    if (this.told(job, [200], 'look')) this.n_waiting = job.json().queue_position ?? 0;
    return this.n_waiting < this.max_waiting;
  }

  /** With a key: asked again until there is an answer, it is one job all the same. */
  async submit(client) {
    if (!client.strands || this.jobs.size > client.limit || !await this.has_room()) return;
    const key = client.key ?? `${this.seed}-${client.name}-${client.n++}`;
    client.key = key;
    const body = client.body ?? JSON.stringify({ kind: 'fit', strands: client.strands, options: smallest });
    client.body = body;
    const answer = await this.ask('POST', '/v1/jobs', { body, headers: { 'Content-Type': 'application/json', 'Idempotency-Key': key } });
    if (!this.told(answer, [200, 202], 'submit')) return;
    const job = answer.json();
    this.jobs.set(job.id, key);
    this.newest = job.id;
    this.n_waiting = job.queue_position ?? 0;
    client.key = client.body = null;
  }

  async create(client) {
    const name = `made by ${client.name}`;
    const answer = await this.ask('POST', '/v1/grooms', { body: JSON.stringify(groom_document({ name, n: 12, m: 6 })), headers: { 'Content-Type': 'application/json' } });
    if (!this.told(answer, [201], 'import')) return;
    const { id, groom } = answer.json();
    client.groom = groom ?? id;
    this.grooms.set(client.groom, new Map([[1, name]]));
  }

  /** Not told, it may have happened or not: the next edit starts from what is there. */
  async edit(client) {
    if (!client.groom) return this.create(client);
    const known = this.grooms.get(client.groom), latest = client.revision ?? Math.max(...known.keys());
    const name = `${client.name} ${client.n++}`;
    const answer = await this.ask('PATCH', `/v1/grooms/${client.groom}`, { body: JSON.stringify({ name }), headers: { 'Content-Type': 'application/merge-patch+json', 'If-Match': `"${latest}"` } });
    client.revision = undefined;
    if (answer?.status === 412) {
      const now = await this.ask('GET', `/v1/grooms/${client.groom}?arrays=false`);
      if (this.told(now, [200], 'look')) client.revision = now.json().revision;
    } else if (this.told(answer, [201], 'edit')) known.set(answer.json().revision, name);
  }

  /** Events that were seen stay what they were. */
  async follow(client) {
    const ids = [...this.jobs.keys()];
    if (!ids.length) return;
    const id = ids[Math.floor(client.next() * ids.length)];
    const job = await this.ask('GET', `/v1/jobs/${id}`);
    if (!this.told(job, [200], `job ${id}`) || !end_states.has(job.json().state)) return;
    const answer = await this.ask('GET', `/v1/jobs/${id}/events`);
    if (this.told(answer, [200], `events of ${id}`)) this.events.set(id, answer.bytes.toString());
  }

  /** Each client pauses up to pace_ms between two calls. */
  start(n_clients, max_jobs = Infinity, pace_ms = 25) {
    this.running = true;
    const doings = ['upload', 'submit', 'submit', 'edit', 'edit', 'follow'];
    this.clients = Array.from({ length: n_clients }, async (_, i) => {
      const client = { name: `client-${i}`, next: random(this.seed * 1000 + i), n: 0, limit: max_jobs };
      while (this.running) {
        await this[doings[Math.floor(client.next() * doings.length)]](client);
        await sleep(pace_ms * (0.2 + 0.8 * client.next()));
      }
    });
  }

  async stop() {
    this.running = false;
    await Promise.all(this.clients);
  }

  /** Until nothing is queued or running; answers every job. */
  async drain(timeout_ms) {
    const end = Date.now() + timeout_ms;
    for (;;) {
      const open = [];
      for (const state of ['queued', 'running']) open.push(...(await this.daemon.json(`/v1/jobs?state=${state}&limit=1000`)).jobs);
      if (!open.length) return;
      assert.ok(Date.now() < end, `${open.length} jobs do not end: ${JSON.stringify(open[0])}`);
      await sleep(200);
    }
  }

  async all(path, key) {
    const found = [];
    for (let before = ''; ;) {
      const page = await this.daemon.json(`${path}?limit=1000${before}`);
      found.push(...page[key]);
      if (!page.next) return found;
      before = `&before=${page.next}`;
    }
  }

  async examine() {
    assert.deepEqual(this.refusals, [], 'answers that no kill explains');
    for (const { id, sha256: wanted } of this.uploads) {
      const answer = await this.ask('GET', `/v1/strands/${id}`);
      assert.equal(answer?.status, 200, `the upload ${id} is gone`);
      assert.equal(answer.json().sha256, wanted);
    }
    for (const { id, sha256: wanted } of this.uploads.slice(-50)) { // their bytes: groomd check reads all
      const answer = await this.ask('GET', `/v1/strands/${id}/data?format=hair`);
      assert.equal(answer?.status, 200, `the bytes of ${id}`);
      assert.ok(wanted && answer.bytes.length > 128);
    }
    const keys = new Map(), results = new Map();
    for (const job of await this.all('/v1/jobs', 'jobs')) {
      assert.equal(job.state, 'succeeded', `${job.id}: ${JSON.stringify(job.error)}`);
      results.set(job.id, job.result.groom);
    }
    for (const [id, key] of this.jobs) {
      assert.ok(results.has(id), `the job ${id} is gone`);
      assert.ok(!keys.has(key), 'one key, two jobs');
      keys.set(key, id);
    }
    assert.equal(new Set(results.values()).size, results.size, 'one groom each');
    const listed = new Set((await this.all('/v1/grooms', 'grooms')).map(({ id }) => id));
    assert.equal(listed.size - [...results.values()].filter((id) => listed.has(id)).length, [...listed].filter((id) => !new Set(results.values()).has(id)).length);
    for (const [id, groom] of results) assert.ok(listed.has(groom), `the groom of ${id} is gone`);
    await this.examine_grooms(results, listed);
    await this.examine_events(results);
    return { uploads: this.uploads.length, jobs: this.jobs.size, all_jobs: results.size, grooms: listed.size, revisions: [...this.grooms.values()].reduce((sum, known) => sum + known.size, 0), calls: this.sent };
  }

  /** Each groom that a fit made has one job; each revision is what its client was told. */
  async examine_grooms(results, listed) {
    const made = new Map();
    for (const id of listed) {
      const answer = await this.ask('GET', `/v1/grooms/${id}?arrays=false`);
      assert.equal(answer?.status, 200, `the groom ${id}`);
      const { job } = answer.json().source ?? {};
      if (!job) continue;
      assert.ok(!made.has(job), `${job} has two grooms: ${made.get(job)} and ${id}`);
      assert.equal(results.get(job), id);
      made.set(job, id);
    }
    assert.equal(made.size, results.size);
    for (const [id, revisions] of this.grooms)
      for (const [number, name] of revisions) {
        const answer = await this.ask('GET', `/v1/grooms/${id}?revision=${number}&arrays=false`);
        assert.equal(answer?.status, 200, `revision ${number} of ${id} is gone`);
        assert.equal(answer.json().name, name);
      }
  }

  async examine_events(results) {
    for (const id of results.keys()) {
      const text = (await this.ask('GET', `/v1/jobs/${id}/events`)).bytes.toString();
      const numbers = [...text.matchAll(/^id: (\d+)$/gm)].map(([, number]) => Number(number));
      assert.deepEqual(numbers, numbers.map((_, i) => i + 1), `events of ${id}`);
      assert.equal([...text.matchAll(/"state":"succeeded"/g)].length, 1, `${id} succeeded once`);
      if (this.events.has(id)) assert.equal(text, this.events.get(id), `events of ${id} have changed`);
    }
  }
}
