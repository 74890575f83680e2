// Faults below the storage: each write, sync, rename, creation, truncation, removal, allocation, read and start of a
// process of one script of uploads, a job, edits and removals fails in turn. After each: the daemon lives, what was acknowledged is there, what
// was refused was refused in good form, the script runs again as if nothing had been, and groomd check is clean.
//
// FAULTS=all takes every call (make test-service); else a sample of them.
import test from 'node:test';
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { build, run, slowness } from '../support/daemon.mjs';
import { call, expect, groom_document, hair, refused } from '../support/api.mjs';
import { startFaultyDaemon } from '../support/faults.mjs';

const all = process.env.FAULTS === 'all';
const version = { 'Tus-Resumable': '1.0.0' };
const merge = { 'Content-Type': 'application/merge-patch+json' };
let serial = 0;

/** The script. `told` gets what the daemon has acknowledged: target -> status that it must answer. */
async function script(daemon, told) {
  const n = 1 + serial++ % 4000;
  const refusals = [];
  /* under a failing allocation a connection may break; then nothing was acknowledged, neither that it was done nor
     that it was not: what a removal was to remove may be there or gone */
  const step = async (...request) => {
    const answer = await call(daemon, ...request).catch((error) => {
      if (error instanceof assert.AssertionError) throw error;
      return { status: 0 };
    });
    if (answer.status >= 400 || !answer.status) refusals.push(answer.status);
    return answer.status && answer.status < 300 ? answer : null;
  };
  const remove = async (url, claims, options) => {
    const before = refusals.length, done = await step('DELETE', url, options);
    const unknown = !done && refusals[before] === 0;
    for (const claim of claims) if (done) told.set(claim, 404); else if (unknown) told.delete(claim);
    return done || unknown;
  };
  const bytes = hair(1 + n % 200, 2 + Math.floor(n / 200));
  const strands = await step('POST', '/v1/strands', { body: bytes });
  if (strands) told.set(`/v1/strands/${strands.json.id}/data?unit=m`, 200);

  const created = await step('POST', '/v1/uploads', { headers: { ...version, 'Upload-Length': '1000' } });
  const url = created?.headers.get('location');
  if (url) {
    told.set(url, 200);
    const piece = await step('PATCH', url, { headers: { ...version, 'Upload-Offset': '0', 'Content-Type': 'application/offset+octet-stream' }, body: Buffer.alloc(600, n) });
    if (piece) told.set(`${url}#600`, 200);
    if (await remove(url, [url], { headers: version })) told.delete(`${url}#600`);
  }
  const part = hair(1 + n % 200, 30 + Math.floor(n / 200));
  const whole = await step('POST', '/v1/uploads', { headers: { ...version, 'Upload-Length': `${part.length}`, 'Content-Type': 'application/offset+octet-stream' }, body: part });
  if (whole) {
    const used = await step('POST', `/v1/strands?upload=${whole.headers.get('location').split('/').pop()}`);
    if (used) told.set(`/v1/strands/${used.json.id}/data?unit=m`, 200);
  }

  const groom = await step('POST', '/v1/grooms', { body: groom_document({ name: `groom ${n}`, n: 8 + n % 50 }) });
  if (groom) {
    told.set(`/v1/grooms/${groom.json.groom}?revision=1`, 200);
    if (await step('PATCH', `/v1/grooms/${groom.json.groom}`, { headers: { ...merge, 'If-Match': '"1"' }, body: { name: 'x' } })) told.set(`/v1/grooms/${groom.json.groom}?revision=2`, 200);
    await step('GET', `/v1/grooms/${groom.json.groom}/strands?format=ply`); // evaluated, written, sent
    await step('GET', `/v1/grooms/${groom.json.groom}/analysis`);
  }
  if (daemon.token) {
    const work = (method, path, options) => step(method, `/v1/work/${path}`, { token: daemon.token, ...options });
    await work('POST', 'progress', { body: { stage: { name: 'guides', index: 2, count: 5 }, progress: 0.1, losses: [{ iteration: n, name: 'total', value: 1 }] } });
    const state = `state ${serial}`;
    if (await work('PUT', 'checkpoint?stage=1', { headers: { 'Content-Type': 'application/octet-stream' }, body: state })) daemon.checkpoint = state;
  }
  if (strands) {
    const job = await step('POST', '/v1/jobs', { body: { kind: 'fit', strands: strands.json.id } });
    if (job) {
      told.set(`/v1/jobs/${job.json.id}`, 200);
      if (await step('DELETE', `/v1/jobs/${job.json.id}`)) told.set(`/v1/jobs/${job.json.id}#cancelled`, 200);
    }
    if (groom) await remove(`/v1/grooms/${groom.json.groom}`, [1, 2].map((revision) => `/v1/grooms/${groom.json.groom}?revision=${revision}`));
  }
  return refusals;
}

/** All that was acknowledged holds. */
async function verify(daemon, told) {
  for (const [target, status] of told) {
    const [path, claim] = target.split('#');
    const answer = await expect(daemon, status, 'GET', path);
    if (claim === '600') assert.equal(answer.json.offset, 600, target);
    if (claim === 'cancelled') {
      const { json } = await expect(daemon, 200, 'GET', path, { headers: { Prefer: 'wait=10' } });
      assert.equal(json.state, 'cancelled', target);
    }
  }
}

/** The job that has the only slot, whose attempt is ours. */
async function occupy(daemon) {
  const strands = (await call(daemon, 'POST', '/v1/strands', { body: hair(3, 3) })).json;
  daemon.blocker = (await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: strands.id } })).json.id;
  daemon.token = await daemon.attempt();
  daemon.checkpoint = null;
}

/** The next attempt: a worker of these tests does not live for ever. */
async function occupy_anew(daemon) {
  await call(daemon, 'DELETE', `/v1/jobs/${daemon.blocker}`);
  await call(daemon, 'GET', `/v1/jobs/${daemon.blocker}`, { headers: { Prefer: 'wait=10' } });
  await occupy(daemon);
}

/** The last checkpoint that was acknowledged, or a later one. */
async function verify_checkpoint(daemon) {
  const { json } = await expect(daemon, 200, 'GET', '/v1/work/job', { token: daemon.token });
  if (!daemon.checkpoint) return;
  const kept = (await expect(daemon, 200, 'GET', `/v1/work/blobs/${json.checkpoint.sha256}`, { token: daemon.token })).text;
  assert.ok(Number(kept.split(' ')[1]) >= Number(daemon.checkpoint.split(' ')[1]), `${kept} is older than ${daemon.checkpoint}`);
}

async function check_clean(daemon, what) {
  const { status, stdout, stderr } = await run(join(build, 'groomd'), ['check', '--data', daemon.data]);
  assert.equal(status, 0, `${what}: ${stdout}${stderr}`);
}

/** The job queue is empty again, so that one script does not stand in the way of the next. */
async function settle(daemon) {
  for (const { id } of (await expect(daemon, 200, 'GET', '/v1/jobs?state=queued')).json.jobs)
    await expect(daemon, 200, 'DELETE', `/v1/jobs/${id}`);
}

/** How many calls of each kind one script makes. */
async function measure(daemon, faults) {
  await script(daemon, new Map());
  await settle(daemon);
  const before = faults.counts;
  await script(daemon, new Map());
  const after = faults.counts;
  return (kind) => after[kind] - before[kind];
}

const plans = [
  ['write', 'EIO', 37], ['write', 'ENOSPC', 37], ['write', 0, 53], ['sync', 'EIO', 11], ['rename', 'EIO', 2], ['create', 'EMFILE', 5],
  ['truncate', 'EIO', 2], ['remove', 'EACCES', 3], ['read', 'EIO', 5], ['spawn', 'EAGAIN', 3], ...(slowness === 1 ? [['allocate', 'ENOMEM', 613]] : []),
];

/** What a program or library defines, or takes from others. */
async function symbols(path, which) {
  const { status, stdout, stderr } = await run('nm', ['-D', `--${which}-only`, path]);
  assert.equal(status, 0, stderr);
  return stdout.split('\n').filter(Boolean).map((line) => line.split(' ').at(-1).replace(/@.*/, ''));
}

test('no call that changes the disk, takes memory or starts a process is left out', async (t) => {
  const libraries = (await run('ldd', [join(build, 'groomd')])).stdout, where = (name) => new RegExp(`${name.replaceAll('.', '\\.')} => (\\S+)`).exec(libraries)[1];
  const changes = /^(p?writev?(64)?(v2)?|pwritev?2?(64)?|f(data)?sync|syncfs|sync_file_range|msync|rename(at2?)?|link(at)?|symlink(at)?|unlink(at)?|remove|rmdir|mkdir(at)?|open(64)?|openat(64)?|creat(64)?|mkstemp(64)?|f?truncate(64)?|(posix_)?fallocate(64)?|copy_file_range|p?read(64)?|preadv?2?(64)?|fork|vfork|clone|posix_spawnp?|system|popen|pipe2?|malloc|calloc|realloc|reallocarray|aligned_alloc|posix_memalign|memalign|mmap(64)?|mremap)$/;
  // SQLite maps nothing: its WAL's index is in memory that malloc gave (VFS unix-excl), PRAGMA mmap_size is 0
  const elsewhere = new Set(['mmap64', 'mremap']);
  const failing = new Set(await symbols(join(build, 'tests/libfault.so'), 'defined'));
  const left = [];
  for (const path of [join(build, 'groomd'), where('libsqlite3.so.0')])
    left.push(...(await symbols(path, 'undefined')).filter((name) => changes.test(name) && !failing.has(name) && !elsewhere.has(name)));
  const sanitized = slowness > 1 ? /^(malloc|calloc|realloc|aligned_alloc|posix_memalign|mmap)$/ : /^$/;
  assert.deepEqual(left.filter((name) => !sanitized.test(name)), []);
  t.diagnostic(`${[...failing].filter((name) => changes.test(name)).length} calls can be made to fail`);
});

test('each call fails in turn', async (t) => {
  const { daemon, faults } = await startFaultyDaemon(t);
  await occupy(daemon);
  const per_script = await measure(daemon, faults);
  const kept = new Map();
  let n_fired = 0, n_refused = 0, n_hidden = 0;
  for (const [kind, error, sample] of plans) {
    await t.test(`${kind} with ${error || 'half done'}`, async () => {
      const n = per_script(kind), stride = all ? (kind === 'allocate' ? 23 : 1) : sample;
      await occupy_anew(daemon);
      t.diagnostic(`${n} of ${kind} in one script, every ${stride} of them`);
      assert.ok(n > 0, `the script makes no ${kind}`);
      for (let nth = 1 + serial % stride; nth <= n; nth += stride) {
        const told = new Map(), failed = faults.failed;
        faults.arm(kind, nth, error);
        const refusals = await script(daemon, told);
        faults.disarm();
        const fired = faults.failed > failed;
        n_fired += fired;
        n_refused += fired && refusals.length > 0;
        n_hidden += fired && refusals.length === 0;
        assert.ok(daemon.child.exitCode === null && daemon.child.signalCode === null, `${kind} ${nth}: the daemon has died\n${daemon.log().slice(-2000)}`);
        await settle(daemon);
        await verify(daemon, told).catch((cause) => { throw new Error(`${kind} ${nth} of ${n} (${error}), answers ${refusals}: ${cause.message}`, { cause }); });
        await verify_checkpoint(daemon);
        const again = await script(daemon, kept);
        assert.deepEqual(again.filter((status) => status !== 409), [], `after ${kind} ${nth} the script runs as before`);
        await settle(daemon);
        if (nth % 10 === 0) await check_clean(daemon, `${kind} ${nth}`);
      }
      await check_clean(daemon, kind);
    });
  }
  t.diagnostic(`${n_fired} calls failed: ${n_refused} were refused to the client, ${n_hidden} were made good`);
  await daemon.kill();
  await daemon.start();
  await verify(daemon, kept);
  await check_clean(daemon, 'at the end');
});

test('a full disk and one that is read-only: clear answers, reading goes on, and all is well when it has room again', async (t) => {
  const { daemon, faults } = await startFaultyDaemon(t);
  const told = new Map();
  await occupy(daemon);
  await script(daemon, told);
  await settle(daemon);
  for (const [error, status] of [['ENOSPC', 507], ['EROFS', 500], ['EIO', 500]]) {
    faults.arm('write', 1, error, true);
    for (const [method, target, options] of [
      ['POST', '/v1/strands', { body: hair(300, 20) }], ['POST', '/v1/grooms', { body: groom_document() }],
      ['POST', '/v1/uploads', { headers: { ...version, 'Upload-Length': '5' } }],
    ]) await refused(daemon, status, status === 507 ? 'no-space' : 'io-error', method, target, options);
    await refused(daemon, 503, 'not-ready', 'GET', '/readyz', { problem: { detail: /./ } });
    await expect(daemon, 200, 'GET', '/healthz');
    await verify(daemon, told);
    faults.disarm();
    await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(301, 20 + status % 7 + error.length) });
    await new Promise((done) => setTimeout(done, 1100)); // what readiness found holds for a second
    await expect(daemon, 200, 'GET', '/readyz');
  }
  await check_clean(daemon, 'at the end');
});
