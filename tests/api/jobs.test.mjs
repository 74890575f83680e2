// Jobs: submit, look, wait, cancel, watch; and the worker's side of them, played by the test.
import test from 'node:test';
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { startDaemon, until } from '../support/daemon.mjs';
import { call, events, expect, groom_document, refused, startIdleDaemon, submit, upload } from '../support/api.mjs';

test('submissions are checked field by field', async (t) => {
  const daemon = await startIdleDaemon(t);
  const { id: strands } = await upload(daemon);
  const post = (status, name, body, problem) => refused(daemon, status, name, 'POST', '/v1/jobs', { body, problem });
  await post(400, 'invalid-argument', { strands }, { pointer: '/kind' });
  await post(400, 'invalid-argument', { kind: 'braid', strands }, { pointer: '/kind' });
  await post(400, 'invalid-argument', { kind: 'fit' }, { pointer: '/strands' });
  await post(400, 'invalid-argument', { kind: 'fit', strands: 7 }, { pointer: '/strands' });
  await post(422, 'invalid-argument', { kind: 'fit', strands: 'str_nothing' }, { pointer: '/strands' });
  await post(422, 'invalid-argument', { kind: 'fit', strands, head: strands }, { pointer: '/head' });
  await post(400, 'invalid-argument', { kind: 'fit', strands, option: {} }, { pointer: '/option' });
  await post(400, 'invalid-argument', { kind: 'fit', strands, priority: 1.5 }, { pointer: '/priority' });
  await post(400, 'invalid-argument', { kind: 'fit', strands, options: { guides: -1 } }, { pointer: '/options/guides' });
  await post(400, 'invalid-argument', { kind: 'fit', strands, options: { guidez: 1 } }, { pointer: '/options/guidez', detail: /guides/ });
  await post(400, 'invalid-argument', { kind: 'fit', strands, options: 7 }, { pointer: '/options' });
  for (const body of ['{', '[]', 'null', '{"kind":"fit","kind":"fit"}', '{"a":1e999}', '{"a":"\\u0000"}', '['.repeat(1000) + ']'.repeat(1000)])
    assert.equal((await call(daemon, 'POST', '/v1/jobs', { headers: { 'Content-Type': 'application/json' }, body })).status, 400, body.slice(0, 30));
  const { json } = await refused(daemon, 400, 'invalid-json', 'POST', '/v1/jobs', { headers: { 'Content-Type': 'application/json' }, body: '{"kind":"fit",}' });
  assert.equal(json.byte_offset, 14);
  await refused(daemon, 415, 'unsupported-media-type', 'POST', '/v1/jobs', { headers: { 'Content-Type': 'text/plain' }, body: '{}' });
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/jobs')).json.jobs, []);
});

test('a job is queued with all of its options, listed and found', async (t) => {
  const daemon = await startIdleDaemon(t);
  const job = await submit(daemon, { options: { seed: 5 }, priority: 3 });
  assert.equal(job.options.seed, 5);
  assert.ok(Object.keys(job.options).length > 5, 'defaults are filled in');
  const { json } = await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`);
  assert.equal(json.id, job.id);
  await until('it runs', async () => (await call(daemon, 'GET', `/v1/jobs/${job.id}`)).json.state === 'running');
  const other = await submit(daemon);
  assert.equal((await call(daemon, 'GET', `/v1/jobs/${other.id}`)).json.queue_position, 0);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/jobs')).json.jobs.map(({ id }) => id), [other.id, job.id]);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/jobs?state=running')).json.jobs.map(({ id }) => id), [job.id]);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/jobs?state=failed')).json.jobs, []);
  const page = (await expect(daemon, 200, 'GET', '/v1/jobs?limit=1')).json;
  assert.deepEqual((await expect(daemon, 200, 'GET', `/v1/jobs?limit=1&before=${page.next}`)).json.jobs.map(({ id }) => id), [job.id]);
  await refused(daemon, 404, 'not-found', 'GET', '/v1/jobs/job_nothing');
  await refused(daemon, 404, 'not-found', 'DELETE', '/v1/jobs/job_nothing');
  await refused(daemon, 404, 'not-found', 'GET', '/v1/jobs/job_nothing/events');
  await refused(daemon, 404, 'not-found', 'GET', '/v1/jobs/job_nothing/losses');
});

test('cameras come as NeRF and COLMAP write them', async (t) => {
  const daemon = await startIdleDaemon(t);
  const { id: strands } = await upload(daemon);
  const frame = { file_path: 'images/front.png', transform_matrix: [[1, 0, 0, 0], [0, 1, 0, 160], [0, 0, 1, 100], [0, 0, 0, 1]] };
  const forms = [
    { w: 640, h: 480, fl_x: 500, unit: 'cm', frames: [frame] },
    { unit: 'cm', cameras_txt: '1 SIMPLE_PINHOLE 640 480 500 320 240\n', images_txt: '1 0 1 0 0 0 160 100 1 images/front.png\n\n' },
  ];
  for (const cameras of forms) {
    const job = await submit(daemon, { strands, options: { visibility: { cameras } } });
    assert.equal(job.options.visibility.cameras.length, 1);
    const [{ name, fx, width, translation, rotation }] = job.options.visibility.cameras;
    assert.deepEqual({ name, fx, width }, { name: 'front.png', fx: 500, width: 640 });
    [0, 1.6, 1].forEach((wanted, k) => assert.ok(Math.abs(translation[k] - wanted) < 1e-9));
    [[1, 0, 0], [0, -1, 0], [0, 0, -1]].flat().forEach((wanted, k) => assert.ok(Math.abs(rotation.flat()[k] - wanted) < 1e-9));
  }
  const post = (cameras, pointer) => refused(daemon, 400, 'invalid-argument', 'POST', '/v1/jobs',
    { body: { kind: 'fit', strands, options: { visibility: { cameras } } }, problem: { pointer } });
  await post({ frames: [{}] }, '/options/visibility/cameras');
  await post({ frames: [frame], unit: 'ell' }, '/options/visibility/cameras/unit');
  await post({ cameras_txt: '', images_txt: '1 2 3' }, '/options/visibility/cameras');
  await post('front', '/options/visibility/cameras');
});

test('an idempotency key makes one job', async (t) => {
  const daemon = await startIdleDaemon(t);
  const { id: strands } = await upload(daemon);
  const post = (body, key = 'key 1') => call(daemon, 'POST', '/v1/jobs', { headers: { 'Idempotency-Key': key }, body });
  const answers = await Promise.all(Array.from({ length: 6 }, () => post({ kind: 'fit', strands })));
  assert.deepEqual(new Set(answers.map(({ status }) => status)), new Set([202]));
  assert.equal(new Set(answers.map(({ json }) => json.id)).size, 1);
  assert.equal(answers.filter(({ headers }) => headers.get('idempotent-replayed') === 'true').length, 5);
  const again = await post({ kind: 'fit', strands, options: { seed: 9 } });
  assert.equal(again.status, 422);
  assert.equal(again.json.type, '/problems/idempotency-key-reused');
  assert.equal((await post({ kind: 'fit', strands }, 'key 2')).status, 202);
  assert.equal((await expect(daemon, 200, 'GET', '/v1/jobs')).json.jobs.length, 2);
});

test('a worker does a job from its order to its result', async (t) => {
  const daemon = await startIdleDaemon(t);
  const job = await submit(daemon, { options: { seed: 5 } });
  const token = await daemon.attempt();
  const work = (status, method, path, options = {}) => expect(daemon, status, method, `/v1/work/${path}`, { token, ...options });
  const order = (await work(200, 'GET', 'job')).json;
  assert.equal(order.job, job.id);
  assert.equal(order.attempt, 1);
  assert.deepEqual(order.options, job.options);
  assert.equal(order.checkpoint, null);
  const input = await work(200, 'GET', `blobs/${order.inputs.strands.sha256}`);
  assert.equal(createHash('sha256').update(input.bytes).digest('hex'), order.inputs.strands.sha256);
  assert.equal((await work(404, 'GET', `blobs/${'0'.repeat(64)}`)).json.type, '/problems/not-found');

  const stages = ['initialize', 'guides'];
  for (const [index, name] of stages.entries()) {
    assert.deepEqual((await work(200, 'POST', 'progress', { body: {
      stage: { name, index, count: 2 }, progress: index / 2, eta_s: 10,
      losses: [{ iteration: 1, name: 'position', value: 0.5 }, { iteration: 2, name: 'position', value: 0.25 }] } })).json, { cancel: false });
    await work(204, 'PUT', `checkpoint?stage=${index + 1}`, { body: Buffer.from(`state ${index}`) });
  }
  const running = (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`)).json;
  assert.equal(running.state, 'running');
  assert.deepEqual(running.stage, { name: 'guides', index: 1, count: 2 });
  assert.equal(running.progress, 0.5);
  assert.equal(running.loss.position, 0.25);
  const kept = (await work(200, 'GET', 'job')).json.checkpoint;
  assert.equal(kept.stage, 2);
  assert.equal((await work(200, 'GET', `blobs/${kept.sha256}`)).text, 'state 1');
  await work(400, 'PUT', 'checkpoint', { body: 'x' });
  await work(400, 'PUT', 'checkpoint?stage=-1', { body: 'x' });
  await work(400, 'POST', 'progress', { body: { progress: 'half' } });

  const waiting = call(daemon, 'GET', `/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=60' } });
  await work(204, 'POST', 'result', { body: groom_document({ name: 'fitted' }) });
  const done = (await waiting).json;
  assert.equal(done.state, 'succeeded');
  assert.equal(done.progress, 1);
  const groom = (await expect(daemon, 200, 'GET', `/v1/grooms/${done.result.groom}`)).json;
  assert.equal(groom.source.job, job.id);
  assert.equal(groom.source.strands, job.strands);
  assert.equal((await work(409, 'POST', 'result', { body: groom_document() })).json.type, '/problems/conflict');
  const losses = (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}/losses`)).json;
  assert.deepEqual(losses.initialize, [{ iteration: 1, name: 'position', value: 0.5 }, { iteration: 2, name: 'position', value: 0.25 }]);

  await t.test('how long its stages took is in /metrics', async () => {
    const { text } = await expect(daemon, 200, 'GET', '/metrics');
    for (const stage of stages) {
      assert.match(text, new RegExp(`^groomd_stage_seconds_count\\{kind="fit",stage="${stage}"\\} 1$`, 'm'));
      assert.match(text, new RegExp(`^groomd_stage_seconds_bucket\\{kind="fit",stage="${stage}",le="3600"\\} 1$`, 'm'));
    }
  });
  await t.test('each line of the log that is about it has its id, and that of the request', async () => {
    const lines = daemon.log().trim().split('\n').map((line) => JSON.parse(line));
    // what is refused before its token was looked at is about nobody's job
    const about = lines.filter((line) => (/^\/v1\/work/.test(line.path ?? '') && line.token) || /^\/v1\/jobs\//.test(line.path ?? '') || line.message === 'job' || (line.method === 'POST' && line.path === '/v1/jobs'));
    assert.ok(about.length > 8);
    for (const line of about) assert.equal(line.job, job.id, JSON.stringify(line));
    const moves = lines.filter(({ message }) => message === 'job');
    assert.deepEqual(moves.map(({ state }) => state), ['queued', 'running', 'succeeded']);
    assert.equal(moves[0].request, lines.find((line) => line.method === 'POST' && line.path === '/v1/jobs').request);
    assert.equal(moves[2].request, lines.find((line) => line.path === '/v1/work/result' && line.status === 204).request);
    assert.equal(moves[2].attempt, 1);
  });
  await t.test('its events are replayed from any of them', async () => {
    const all = await events(daemon, `/v1/jobs/${job.id}/events`);
    assert.deepEqual(all.map(({ id }) => id), all.map((_, i) => i + 1));
    assert.equal(all.at(-1).event, 'state');
    assert.equal(all.at(-1).data.state, 'succeeded');
    assert.deepEqual(new Set(all.map(({ event }) => event)), new Set(['state', 'stage', 'progress', 'loss']));
    const rest = await events(daemon, `/v1/jobs/${job.id}/events`, { headers: { 'Last-Event-ID': String(all[2].id) } });
    assert.deepEqual(rest, all.slice(3));
    assert.deepEqual(await events(daemon, `/v1/jobs/${job.id}/events?after=${all[2].id}`), all.slice(3));
    await expect(daemon, 204, 'GET', `/v1/jobs/${job.id}/events`, { headers: { 'Last-Event-ID': String(all.length) } });
    await refused(daemon, 400, 'invalid-argument', 'GET', `/v1/jobs/${job.id}/events`, { headers: { 'Last-Event-ID': 'x' } });
  });
});

test('events come while the job goes on, to many at once', async (t) => {
  const daemon = await startIdleDaemon(t);
  const job = await submit(daemon);
  const token = await daemon.attempt();
  const followers = Array.from({ length: 20 }, () => events(daemon, `/v1/jobs/${job.id}/events`));
  for (let i = 1; i <= 30; i++)
    await expect(daemon, 200, 'POST', '/v1/work/progress', { token, body: { stage: { name: 'guides', index: 0, count: 1 }, progress: i / 40, losses: [{ iteration: i, name: 'position', value: 1 / i }] } });
  await expect(daemon, 204, 'POST', '/v1/work/failed', { token, body: { type: '/problems/degenerate', title: 'x', status: 422, detail: 'no hair here' } });
  const streams = await Promise.all(followers);
  for (const stream of streams) {
    assert.deepEqual(stream.map(({ id }) => id), stream.map((_, i) => i + 1), 'none is missing, none comes twice');
    assert.equal(stream.at(-1).data.state, 'failed');
    assert.deepEqual(stream, streams[0]);
  }
  const { json } = await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`);
  assert.equal(json.state, 'failed');
  assert.match(json.error.detail, /no hair here/);
});

test('waiting ends with its time, and a short one is short', async (t) => {
  const daemon = await startIdleDaemon(t);
  const job = await submit(daemon);
  await daemon.attempt();
  const from = Date.now();
  const { json } = await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`, { headers: { Prefer: 'respond-async, wait=1' } });
  assert.equal(json.state, 'running');
  assert.ok(Date.now() - from >= 950);
  await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=no' } });
  const impatient = new AbortController();
  const broken = daemon.fetch(`/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=30' }, signal: impatient.signal }).catch(() => null);
  setTimeout(() => impatient.abort(), 200);
  await broken;
  await expect(daemon, 200, 'GET', '/healthz');
});

test('cancelling stops what runs and forgets what waits', async (t) => {
  const daemon = await startIdleDaemon(t);
  const running = await submit(daemon), queued = await submit(daemon);
  const token = await daemon.attempt();
  const gone = await expect(daemon, 200, 'DELETE', `/v1/jobs/${queued.id}`);
  assert.equal(gone.json.state, 'cancelled');
  const asked = await expect(daemon, 202, 'DELETE', `/v1/jobs/${running.id}`);
  assert.equal(asked.json.cancel_requested, true);
  const { json } = await expect(daemon, 200, 'GET', `/v1/jobs/${running.id}`, { headers: { Prefer: 'wait=30' } });
  assert.equal(json.state, 'cancelled');
  assert.equal((await expect(daemon, 409, 'GET', '/v1/work/job', { token })).json.type, '/problems/conflict');
  assert.equal((await expect(daemon, 200, 'DELETE', `/v1/jobs/${running.id}`)).json.state, 'cancelled');
});

test('only an attempt may work, and only the present one', async (t) => {
  const daemon = await startIdleDaemon(t);
  for (const [method, path] of [['GET', 'job'], ['GET', `blobs/${'0'.repeat(64)}`], ['POST', 'progress'], ['PUT', 'checkpoint?stage=1'], ['POST', 'result'], ['POST', 'failed'], ['POST', 'ended']]) {
    const body = method === 'GET' ? undefined : '{}';
    const options = { body, headers: body ? { 'Content-Type': 'application/json' } : {} };
    const { headers } = await refused(daemon, 401, 'unauthorized', method, `/v1/work/${path}`, options);
    assert.match(headers.get('www-authenticate'), /^Bearer/);
    await refused(daemon, 401, 'unauthorized', method, `/v1/work/${path}`, { ...options, token: 'f'.repeat(64) });
  }
  await refused(daemon, 401, 'unauthorized', 'PUT', '/v1/work/checkpoint?stage=1', { body: Buffer.alloc(3 << 20), token: 'x' });
  const job = await submit(daemon);
  const first = await daemon.attempt();
  await expect(daemon, 204, 'PUT', '/v1/work/checkpoint?stage=1', { token: first, body: 'half way' });
  await daemon.kill();
  await daemon.start();
  const second = await daemon.attempt();
  assert.notEqual(first, second);
  await refused(daemon, 409, 'conflict', 'POST', '/v1/work/progress', { token: first, body: { progress: 0.9 } });
  await refused(daemon, 409, 'conflict', 'POST', '/v1/work/result', { token: first, body: groom_document() });
  const order = (await expect(daemon, 200, 'GET', '/v1/work/job', { token: second })).json;
  assert.equal(order.job, job.id);
  assert.equal(order.attempt, 2);
  assert.equal((await expect(daemon, 200, 'GET', `/v1/work/blobs/${order.checkpoint.sha256}`, { token: second })).text, 'half way');
  await refused(daemon, 400, 'invalid-argument', 'POST', '/v1/work/result', { token: second, body: { format: 'groom/1', unit: 'm' } });
  // a cluster starts the same attempt again: its next run takes over, and the one before is fenced off
  const run = `${second}.1`;
  await expect(daemon, 200, 'POST', '/v1/work/progress', { token: second, body: {} });
  await expect(daemon, 200, 'GET', '/v1/work/job', { token: run });
  await refused(daemon, 409, 'conflict', 'POST', '/v1/work/progress', { token: second, body: {} });
  await refused(daemon, 401, 'unauthorized', 'POST', '/v1/work/progress', { token: `${second}.x`, body: {} });
  await refused(daemon, 400, 'invalid-argument', 'POST', '/v1/work/ended', { token: run, body: {}, problem: { pointer: '/words' } });
  await expect(daemon, 204, 'POST', '/v1/work/ended', { token: run, body: { words: 'signal 11\nlast words' } });
  await expect(daemon, 204, 'POST', '/v1/work/result', { token: run, body: groom_document() });
});
