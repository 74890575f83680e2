// Retargeting: strands and grooms are carried from the head that they are on to others.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { groomctl, startDaemon } from '../support/daemon.mjs';
import { array, decode, expect, groom_document, hair, refused, startIdleDaemon } from '../support/api.mjs';

const N = 60, M = 12, CENTRE = [0, 1.6, 0], RADIUS = 0.1;
const unit = (i, of) => { // directions spread over the upper half
  const y = 1 - (i + 0.5) / of, r = Math.sqrt(1 - y * y), a = i * 2.399963;
  return [r * Math.cos(a), y, r * Math.sin(a)];
};
/** Hair that leaves a ball along its surface's normal, sinks a little, and curls. */
const strands = (n = N) => Array.from({ length: n }, (_, i) => Array.from({ length: M }, (_unused, j) => {
  const d = unit(i, n), s = (0.1 * j) / (M - 1);
  return d.map((x, k) => Math.fround(CENTRE[k] + x * (RADIUS + s) + (k === 1 ? -3 * s * s : 0.004 * (Math.sin(40 * s + i) - Math.sin(i)))));
}));
/** A closed ball of 2 n columns and n rows, its sides scaled. */
const ball = (scale = [1, 1, 1], n = 12) => {
  const lines = [`v 0 ${CENTRE[1] + RADIUS * scale[1]} 0`];
  for (let i = 1; i < n; i++) for (let j = 0; j < 2 * n; j++) {
    const polar = (Math.PI * i) / n, a = (Math.PI * j) / n;
    const p = [Math.sin(polar) * Math.cos(a), Math.cos(polar), Math.sin(polar) * Math.sin(a)];
    lines.push(`v ${p.map((x, k) => CENTRE[k] + RADIUS * scale[k] * x).join(' ')}`);
  }
  lines.push(`v 0 ${CENTRE[1] - RADIUS * scale[1]} 0`);
  const at = (i, j) => 2 + (i - 1) * 2 * n + (j % (2 * n)), last = 2 + (n - 1) * 2 * n;
  for (let j = 0; j < 2 * n; j++) {
    lines.push(`f 1 ${at(1, j + 1)} ${at(1, j)}`, `f ${last} ${at(n - 1, j)} ${at(n - 1, j + 1)}`);
    for (let i = 1; i < n - 1; i++) lines.push(`f ${at(i, j)} ${at(i, j + 1)} ${at(i + 1, j + 1)}`, `f ${at(i, j)} ${at(i + 1, j + 1)} ${at(i + 1, j)}`);
  }
  return lines.join('\n') + '\n';
};
const WIDE = [1.25, 1.1, 0.9];
/** How far from the middle of a scaled ball, in its own measure: 1 is its surface. */
const measure = (p, scale) => Math.hypot(...p.map((x, k) => (x - CENTRE[k]) / (RADIUS * scale[k])));

const post_strands = async (daemon, body = hair(N, M, strands())) => (await expect(daemon, 201, 'POST', '/v1/strands?name=bob', { body })).json.id;
const post_head = async (daemon, name, ...shape) => (await expect(daemon, 201, 'POST', `/v1/heads?name=${name}`, { body: ball(...shape) })).json.id;
const submit = async (daemon, body) => (await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'retarget', ...body } })).json;
const ended = async (daemon, job) => (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=60' } })).json;
const carried = async (daemon, body) => {
  const job = await ended(daemon, await submit(daemon, body));
  assert.equal(job.state, 'succeeded', JSON.stringify(job.error));
  return job;
};
const points_of = async (daemon, id) => {
  const { strands: list } = (await expect(daemon, 200, 'GET', `/v1/grooms/${id}/strands?format=json`)).json;
  return list;
};
const outside = (list, scale) => {
  for (const strand of list) for (const p of strand.slice(1)) assert.ok(measure(p, scale) > 0.99, `${p} is inside`);
};

test('uploaded strands become a groom on the other head, with a report and colours', async (t) => {
  const daemon = await startDaemon(t);
  const str = await post_strands(daemon), head = await post_head(daemon, 'ann'), target = await post_head(daemon, 'mara', WIDE);
  const job = await carried(daemon, { strands: str, source: { head }, target: { head: target }, options: { guides: 12 } });
  assert.equal(job.options.alpha, 3000);
  assert.equal(job.options.guides, 12);
  assert.deepEqual(job.targets, [{ head: target }]);
  assert.equal(job.result.grooms.length, 1);
  const [made] = job.result.grooms;
  assert.equal(made.groom, job.result.groom);
  assert.equal(made.head, target);
  assert.ok(made.report.energy.after.total < made.report.energy.before.total);
  assert.equal(made.report.inside.after.vertices, 0);

  const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${made.groom}`)).json;
  assert.equal(document.name, 'bob on mara');
  assert.deepEqual(document.source, { strands: made.strands, head: target, job: job.id });
  assert.equal(document.base.strands, made.strands);
  assert.equal(document.retarget.from.strands, str);
  assert.equal(document.retarget.from.head, head);
  assert.deepEqual(document.retarget.skeleton.bones.map(({ name }) => name), document.retarget.from.skeleton.bones.map(({ name }) => name));
  for (const name of ['movement', 'depth', 'stretch']) assert.equal(decode(document.retarget.strands[name]).length, N);
  assert.ok(decode(document.retarget.strands.stretch).every((x) => x > 0.8 && x < 1.4));

  const list = await points_of(daemon, made.groom);
  assert.deepEqual(list.map((strand) => strand.length), Array(N).fill(M));
  outside(list, WIDE);
  for (const strand of list) assert.ok(Math.abs(measure(strand[0], WIDE) - 1) < 0.03, `${measure(strand[0], WIDE)}: roots stay on the surface`);
  const upload = (await expect(daemon, 200, 'GET', `/v1/strands/${made.strands}`)).json;
  assert.equal(upload.strands, N);
  assert.equal(upload.vertices, N * M);

  await t.test('numbers for colours are kept through an edit', async () => {
    await expect(daemon, 201, 'PATCH', `/v1/grooms/${made.groom}`, { headers: { 'Content-Type': 'application/merge-patch+json', 'If-Match': '"1"' }, body: { name: 'mine' } });
    const later = (await expect(daemon, 200, 'GET', `/v1/grooms/${made.groom}`)).json;
    assert.deepEqual(later.retarget, document.retarget);
  });
  await t.test('the same again gives the same strands, from what was prepared', async () => {
    const again = await carried(daemon, { strands: str, source: { head }, target: { head: target }, options: { guides: 12 } });
    assert.notEqual(again.result.groom, made.groom);
    assert.equal(again.result.grooms[0].strands, made.strands); // the same bytes
    assert.deepEqual(await points_of(daemon, again.result.groom), list);
  });
  await t.test('one job carries to many heads', async () => {
    const small = await post_head(daemon, 'tim', [0.8, 0.8, 0.8]);
    const many = await carried(daemon, { strands: str, source: { head }, targets: [{ head: small }, { head: target }], options: { guides: 12 } });
    assert.deepEqual(many.result.grooms.map((groom) => groom.head), [small, target]);
    outside(await points_of(daemon, many.result.grooms[0].groom), [0.8, 0.8, 0.8]);
    assert.deepEqual(await points_of(daemon, many.result.grooms[1].groom), list);
    assert.equal(many.stage.count, 3);
  });
  await t.test('and back again it is nearly as it was', async () => {
    const back = await carried(daemon, { groom: made.groom, target: { head }, options: { guides: 12 } });
    const there = (await expect(daemon, 200, 'GET', `/v1/grooms/${back.result.groom}?arrays=false`)).json;
    assert.equal(there.base.strands, null); // nobody uploaded these
    assert.equal(there.retarget.from.groom, made.groom);
    const before = strands(), after = await points_of(daemon, back.result.groom);
    let sum = 0;
    after.forEach((strand, i) => strand.forEach((p, j) => { sum += Math.hypot(...p.map((x, k) => x - before[i][j][k])); }));
    assert.ok(sum / (N * M) < 6e-3, `${sum / (N * M)} m`); // proportions are unlike: a quarter wider, a tenth flatter
  });
  await t.test('to its own head nothing moves', async () => {
    const same = await carried(daemon, { strands: str, source: { head }, target: { head } });
    const before = strands(), after = await points_of(daemon, same.result.groom);
    let sum = 0;
    after.forEach((strand, i) => strand.forEach((p, j) => { sum += Math.hypot(...p.map((x, k) => x - before[i][j][k])); }));
    assert.ok(sum / (N * M) < 1e-6, `${sum / (N * M)}`);
  });
});

test('a procedural groom stays one: guides move, the chain stays', async (t) => {
  const daemon = await startDaemon(t);
  const head = await post_head(daemon, 'ann'), target = await post_head(daemon, 'mara', WIDE);
  const guides = strands(8);
  const given = groom_document({ n: 24, m: M, guides: 8, name: 'coil' });
  given.guides.points = array('f32', [8, M, 3], guides.flat(2));
  given.strands.roots = array('f32', [24, 3], strands(24).flatMap((strand) => strand[0]));
  given.source = { head };
  const { groom } = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: given })).json;
  const before = (await expect(daemon, 200, 'GET', `/v1/grooms/${groom}`)).json;
  const job = await carried(daemon, { groom, target: { head: target } }); // its source is the head it was made with
  assert.deepEqual(job.source, { head });
  assert.equal(job.revision, 1);
  const after = (await expect(daemon, 200, 'GET', `/v1/grooms/${job.result.groom}`)).json;
  assert.equal(after.name, 'coil on mara');
  assert.equal(after.source.head, target);
  assert.equal(after.base, undefined);
  assert.deepEqual(after.operators, before.operators);
  assert.deepEqual(after.instancing, before.instancing);
  const moved = decode(after.guides.points);
  for (let i = 0; i < moved.length; i += 3)
    if (i % (3 * M)) assert.ok(measure([...moved.slice(i, i + 3)], WIDE) > 0.99);
  const stretch = decode(after.retarget.strands.stretch);
  assert.equal(stretch.length, 24);
  assert.ok(stretch.every((x) => x > 0.7 && x < 1.5), `${stretch}`);
  await t.test('or its strands are carried as they are evaluated', async () => {
    const dense = await carried(daemon, { groom, dense: true, target: { head: target }, options: { guides: 6 } });
    const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${dense.result.groom}?arrays=false`)).json;
    assert.equal(document.base.strands, dense.result.grooms[0].strands);
    assert.equal(document.strands.count, 24);
    assert.equal(document.retarget.from.groom, groom);
  });
});

test('what is wrong with a retargeting is said with its place', async (t) => {
  const daemon = await startDaemon(t);
  const str = await post_strands(daemon), head = await post_head(daemon, 'ann'), source = { head }, target = { head };
  const bad = (status, pointer, body) => refused(daemon, status, 'invalid-argument', 'POST', '/v1/jobs',
    { body: { kind: 'retarget', ...body }, problem: { pointer } });
  const bones = (extra = {}) => ({ bones: [{ name: 'head', head: [0, 1.55, 0], tail: [0, 1.65, 0], ...extra }] });
  for (const [status, pointer, body] of [
    [400, '/strands', { source, target }],
    [422, '/strands', { strands: 'str_aaaaaaaaaaaaaaaaaaaa', source, target }],
    [400, '/groom', { strands: str, groom: 'grm_aaaaaaaaaaaaaaaaaaaa', source, target }],
    [422, '/groom', { groom: 'grm_aaaaaaaaaaaaaaaaaaaa', dense: true, source, target }],
    [400, '/dense', { strands: str, dense: true, source, target }],
    [400, '/dense', { groom: 'grm_aaaaaaaaaaaaaaaaaaaa', dense: 1, source, target }],
    [400, '/source/head', { strands: str, target }],
    [422, '/source/head', { strands: str, source: { head: 'head_aaaaaaaaaaaaaaaaaaaa' }, target }],
    [400, '/source/hats', { strands: str, source: { head, hats: 1 }, target }],
    [400, '/target/head', { strands: str, source }],
    [400, '/target', { strands: str, source, target: head }],
    [400, '/targets', { strands: str, source, targets: [] }],
    [400, '/targets', { strands: str, source, target, targets: [target] }],
    [400, '/targets/1/head', { strands: str, source, targets: [target, {}] }],
    [400, '/source/skeleton/bones/0', { strands: str, source: { head, skeleton: bones({ tail: [0, 1.55, 0] }) }, target }],
    [400, '/options/alpha', { strands: str, source, target, options: { alpha: -1 } }],
    [400, '/options/wigs', { strands: str, source, target, options: { wigs: 1 } }],
    [400, '/head', { strands: str, head, source, target }],
  ]) await bad(status, pointer, body);
});

test('what only shows while it runs fails the job, with its place', async (t) => {
  const daemon = await startDaemon(t);
  const str = await post_strands(daemon), head = await post_head(daemon, 'ann'), coarse = await post_head(daemon, 'coarse', WIDE, 8);
  const failed = async (body, pointer, detail) => {
    const job = await ended(daemon, await submit(daemon, { strands: str, source: { head }, ...body }));
    assert.equal(job.state, 'failed');
    assert.equal(job.error.pointer, pointer, JSON.stringify(job.error));
    assert.match(job.error.detail, detail);
  };
  await failed({ target: { head: coarse } }, '/targets/0/landmarks', /266 vertices.*give landmarks/);
  const skeleton = (name) => ({ bones: [{ name, head: [0, 1.55, 0], tail: [0, 1.65, 0] }] });
  await failed({ source: { head, skeleton: skeleton('head') }, target: { head, skeleton: skeleton('skull') } }, '/targets/0/skeleton/bones', /no bone "head"/);
});

test('an order says what is prepared, and what is handed in is there for the next', async (t) => {
  const daemon = await startIdleDaemon(t);
  const str = await post_strands(daemon), head = await post_head(daemon, 'ann'), target = await post_head(daemon, 'mara', WIDE);
  const asked = { strands: str, source: { head }, target: { head: target } };
  const job = await submit(daemon, asked), token = await daemon.attempt();
  const work = (status, method, path, options) => expect(daemon, status, method, `/v1/work/${path}`, { token, ...options });
  const order = (await work(200, 'GET', 'job')).json;
  assert.equal(order.kind, 'retarget');
  assert.equal(order.preparation, null);
  assert.deepEqual(order.inputs.targets.map(({ id }) => id), [target]);
  assert.equal(order.inputs.source.id, head);
  await work(200, 'GET', `blobs/${order.inputs.targets[0].sha256}`);
  await work(404, 'GET', 'groom');
  await work(204, 'PUT', 'preparation', { body: 'what was worked out' });
  for (const body of ['', 'no line', '{"kind":"strands","bytes":9}\nshort', '{"kind":"strands","bytes":4}\nHAIR'])
    assert.ok((await daemon.fetch('/v1/work/result', { method: 'POST', headers: { Authorization: `Bearer ${token}` }, body })).status >= 400);
  await refused(daemon, 409, 'conflict', 'DELETE', `/v1/heads/${target}`);
  await expect(daemon, 202, 'DELETE', `/v1/jobs/${job.id}`);

  await submit(daemon, { ...asked, options: { alpha: 10 } }); // the same source: alpha does not matter to it
  const second = await daemon.attempt();
  const next = (await expect(daemon, 200, 'GET', '/v1/work/job', { token: second })).json;
  assert.equal(next.preparation.bytes, 19);
  assert.equal((await expect(daemon, 200, 'GET', `/v1/work/blobs/${next.preparation.sha256}`, { token: second })).text, 'what was worked out');
});

test('a preparation that is none is made anew', async (t) => {
  const daemon = await startIdleDaemon(t);
  const str = await post_strands(daemon), head = await post_head(daemon, 'ann'), target = await post_head(daemon, 'mara', WIDE);
  const asked = { strands: str, source: { head }, target: { head: target }, options: { guides: 12 } };
  const job = await submit(daemon, asked), token = await daemon.attempt();
  await expect(daemon, 204, 'PUT', '/v1/work/preparation', { token, body: 'what was worked out' });
  await expect(daemon, 202, 'DELETE', `/v1/jobs/${job.id}`);
  await daemon.stop();
  daemon.args = []; // the real worker
  await daemon.start();
  assert.ok((await carried(daemon, asked)).result.groom);
});

test('groomctl carries from files to a file, and says what it needs', async (t) => {
  const daemon = await startDaemon(t);
  const file = (name, bytes) => { const path = join(daemon.folder, name); writeFileSync(path, bytes); return path; };
  const bob = file('bob.hair', hair(N, M, strands())), ann = file('ann.obj', ball()), mara = file('mara.obj', ball(WIDE)), tim = file('tim.obj', ball([0.8, 0.8, 0.8]));
  const out = join(daemon.folder, 'out.json');
  const done = await groomctl(daemon, ['retarget', bob, mara, '--source', ann, '--guides', '12', '-o', out]);
  assert.equal(done.status, 0, done.stderr);
  assert.match(done.stdout, /grm_\S+ on head_/);
  assert.match(done.stdout, /vertices inside +\d+ +0\n/);
  outside(JSON.parse(readFileSync(out)).strands, WIDE);
  const many = await groomctl(daemon, ['retarget', bob, mara, tim, '--source', ann, '--guides', '12', '--wait']);
  assert.equal(many.status, 0, many.stderr);
  assert.equal(many.stdout.match(/ on head_/g).length, 2);
  for (const [args, complaint] of [[[bob, mara], /--source is missing/], [[bob, mara, tim, '--source', ann, '-o', out], /--output goes with one target/],
    [[bob, mara, '--source', ann, '--dense'], /are for grooms/], [[bob, mara, '--source', ann, '-o', 'out.xyz'], /no extension that names a format/]]) {
    const refusal = await groomctl(daemon, ['retarget', ...args]);
    assert.equal(refusal.status, 2);
    assert.match(refusal.stderr, complaint);
  }
  const torn = await groomctl(daemon, ['retarget', bob, mara, '--source', file('torn.obj', 'v 0 0 0\nf 1 2 3\n')]);
  assert.equal(torn.status, 1);
  assert.match(torn.stderr, /torn.obj|face 0/);
  const line = await groomctl(daemon, ['hairline', file('more.hair', hair(700, M, strands(700))), file('fine.obj', ball(WIDE, 24)), '--source', file('ann24.obj', ball([1, 1, 1], 24)), '--points', '9', '-o', out]);
  assert.equal(line.status, 0, line.stderr);
  assert.equal(JSON.parse(readFileSync(out)).points.length, 9);
  assert.match((await groomctl(daemon, ['options', '--kind', 'retarget'])).stdout, /^alpha +3000 /m);
});

test('the hairline of a target is shown, moved, and the hair grows from there', async (t) => {
  const daemon = await startDaemon(t), n = 700, rows = 24;
  const str = await post_strands(daemon, hair(n, M, strands(n)));
  const head = await post_head(daemon, 'ann', [1, 1, 1], rows), target = await post_head(daemon, 'mara', WIDE, rows);
  const line_of = async (body, at = target) => (await expect(daemon, 200, 'POST', `/v1/heads/${at}/hairline`, { body })).json;
  const today = await line_of({ strands: str, source: { head }, points: 11 });
  assert.equal(today.front.length, 11);
  for (const p of today.front) assert.ok(Math.abs(measure(p, WIDE) - 1) < 0.03 && Math.abs(p[1] - CENTRE[1]) < 0.03, `${p}: near the equator, on the head`);
  assert.ok(today.front[0][0] > 0.09 && today.front[10][0] < -0.09, 'from ear to ear');
  assert.ok(today.front[5][2] > 0.08, 'over the forehead');

  /** The line lifted by so many metres in its middle, on the surface. */
  const lifted = (by) => today.front.map((p, i) => {
    const y = p[1] + by * Math.sin((Math.PI * i) / 10) ** 2, k = Math.sqrt(Math.max(0, 1 - ((y - CENTRE[1]) / (RADIUS * WIDE[1])) ** 2));
    const a = Math.atan2(p[2] / WIDE[2], p[0] / WIDE[0]);
    return [RADIUS * WIDE[0] * k * Math.cos(a), y, RADIUS * WIDE[2] * k * Math.sin(a)];
  });
  const options = { guides: 40, iterations: 4 };
  const job = await carried(daemon, { strands: str, source: { head }, target: { head: target }, hairline: { points: lifted(0.02) }, options });
  assert.equal(job.targets[0].hairline.points.length, 11);
  const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${job.result.groom}`)).json;
  assert.equal(document.retarget.hairline.edit.kind, 'front');
  assert.ok(document.retarget.hairline.density_l1 < 0.2, JSON.stringify(document.retarget.hairline));
  assert.ok(decode(document.retarget.strands.density).some((x) => Math.abs(x) > 0.01));
  const now = await line_of({ groom: job.result.groom, points: 11 });
  assert.ok(Math.abs(now.front[5][1] - today.front[5][1] - 0.02) < 0.008, `lifted by ${now.front[5][1] - today.front[5][1]}`);

  const bald = await carried(daemon, { strands: str, source: { head }, target: { head: target, hairline: { kind: 'balding', points: lifted(0.05) } }, options });
  const less = (await expect(daemon, 200, 'GET', `/v1/grooms/${bald.result.groom}`)).json;
  assert.ok(less.strands.count < n && less.strands.count > n / 2, `${less.strands.count} of ${n}`);
  assert.equal(less.retarget.hairline.bald, n - less.strands.count);
  assert.equal(decode(less.retarget.strands.stretch).length, less.strands.count);

  /** A ring about the top of the target's head. */
  const ring = Array.from({ length: 12 }, (_, i) => [0.04 * Math.cos((Math.PI * i) / 6), CENTRE[1] + 0.95 * RADIUS * WIDE[1], 0.04 * Math.sin((Math.PI * i) / 6)]);
  const crown = await carried(daemon, { strands: str, source: { head }, target: { head: target, hairline: { kind: 'crown', points: ring } }, options });
  const tonsured = (await expect(daemon, 200, 'GET', `/v1/grooms/${crown.result.groom}`)).json;
  assert.ok(tonsured.strands.count < n && tonsured.strands.count > n / 2, `${tonsured.strands.count} of ${n}`);
  assert.equal(tonsured.retarget.hairline.bald, n - tonsured.strands.count);

  const whole = groom_document({ n, m: M, guides: 40, name: 'coil' });
  whole.guides.points = array('f32', [40, M, 3], strands(40).flat(2));
  whole.strands.roots = array('f32', [n, 3], strands(n).flatMap((strand) => strand[0]));
  whole.source = { head };
  const { groom } = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: whole })).json;
  const receded = await carried(daemon, { groom, target: { head: target, hairline: { kind: 'balding', points: lifted(0.05) } } });
  const rest = (await expect(daemon, 200, 'GET', `/v1/grooms/${receded.result.groom}`)).json;
  assert.ok(rest.strands.count < n && rest.strands.count > n / 2, `${rest.strands.count} of ${n}`);
  assert.equal(rest.guides.count, 40);
  assert.equal(decode(rest.retarget.strands.density).length, rest.strands.count);

  for (const [pointer, body] of [['/hairline/points', { hairline: { points: [[0, 1.7, 0]] } }], ['/target/hairline/kind', { target: { head: target, hairline: { kind: 'mullet', points: lifted(0) } } }],
    ['/target/landmarks/1/target', { target: { head: target, landmarks: [{ source: [0, 0, 0], target: [0, 0, 0] }, { source: [0, 0, 0] }, {}, {}] } }]])
    await refused(daemon, 400, 'invalid-argument', 'POST', '/v1/jobs', { body: { kind: 'retarget', strands: str, source: { head }, target: { head: target }, ...body }, problem: { pointer } });
  await refused(daemon, 400, 'invalid-argument', 'POST', `/v1/heads/${target}/hairline`, { body: { strands: str, source: { head }, points: 1 }, problem: { pointer: '/points' } });
  const off = await ended(daemon, await submit(daemon, { strands: str, source: { head }, target: { head: target }, hairline: { points: lifted(0.02).map((p, i) => (i === 4 ? [0, 2, 0] : p)) } }));
  assert.equal(off.error.pointer, '/targets/0/hairline/points/4', JSON.stringify(off.error));
});

test('a head of other triangles is registered by landmarks', async (t) => {
  const daemon = await startDaemon(t);
  const str = await post_strands(daemon), head = await post_head(daemon, 'ann', [1, 1, 1], 16), other = await post_head(daemon, 'coarse', WIDE, 22);
  const on = (d, scale) => d.map((x, k) => CENTRE[k] + RADIUS * scale[k] * x);
  const places = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
  const landmarks = places.map((d) => ({ source: on(d, [1, 1, 1]), target: on(d, WIDE) }));
  const job = await carried(daemon, { strands: str, source: { head }, target: { head: other, landmarks }, options: { guides: 12 } });
  const list = await points_of(daemon, job.result.groom);
  outside(list, WIDE.map((x) => x * 0.98));
  for (const strand of list) assert.ok(Math.abs(measure(strand[0], WIDE) - 1) < 0.05, `${measure(strand[0], WIDE)}`);
});
