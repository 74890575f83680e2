// The lines that the studio offers for a shell do what the page did: each is run as it stands, groomctl's and
// curl's, and what comes of it is compared with the page's own call.
import test from 'node:test';
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { build, temporaryFolder } from '../support/daemon.mjs';
import { call, expect, groom_document, hair, head_obj, startIdleDaemon } from '../support/api.mjs';
import { commandsOf, quoted } from '../../client/web/src/commands.mjs';

const bash = (line, cwd) => new Promise((done) => {
  const child = spawn('bash', ['-euo', 'pipefail', '-c', line], { cwd, env: { ...process.env, PATH: `${build}:${process.env.PATH}`, GROOM_SERVER: '', XDG_STATE_HOME: cwd } });
  let output = '';
  for (const stream of [child.stdout, child.stderr]) stream.on('data', (bytes) => { output += bytes; });
  child.on('exit', (code) => done({ code, output }));
});

/** Both lines of a call, each run in a folder of its own that has the files given: { groomctl, curl } of folders. */
async function both(t, daemon, page_call, files = {}, between = async () => {}) {
  const made = commandsOf(page_call, { origin: daemon.url }), folders = {};
  for (const tool of ['groomctl', 'curl']) {
    folders[tool] = temporaryFolder(t);
    for (const [name, bytes] of Object.entries(files)) writeFileSync(join(folders[tool], name), bytes);
    const { code, output } = await bash(made[tool], folders[tool]);
    assert.equal(code, 0, `${made[tool]}\n${output}`);
    assert.doesNotMatch(output, /"status":[45]/, made[tool]);
    await between(tool, output);
  }
  return folders;
}

const json_patch = 'application/json-patch+json';

test('uploads, a fit, its cancellation, removal', async (t) => {
  const daemon = await startIdleDaemon(t), files = { 'a hair.hair': hair(30, 8), 'head.obj': head_obj() };
  await both(t, daemon, { method: 'POST', path: '/v1/strands?unit=cm&up=z&name=a+hair.hair', file: 'a hair.hair' }, files);
  await both(t, daemon, { method: 'POST', path: '/v1/heads?unit=m&up=y&name=head.obj&upload=upl_x', file: 'head.obj' }, files);
  const { strands } = await daemon.json('/v1/strands'), { heads } = await daemon.json('/v1/heads');
  assert.equal(strands.length, 1, 'the same bytes and options are one upload');
  assert.deepEqual([strands[0].name, strands[0].unit_m, strands[0].up, heads.length], ['a hair.hair', 0.01, 'z', 1]);
  const options = { quality: 'draft', guides: 20, operators: ['curl', 'frizz'], stages: { initialize: { n_smooth: 12 } }, visibility: null };
  const jobs = [];
  await both(t, daemon, { method: 'POST', path: '/v1/jobs', body: { kind: 'fit', strands: strands[0].id, head: heads[0].id, options } }, {},
    async () => { jobs.push((await daemon.json('/v1/jobs')).jobs[0]); });
  assert.notEqual(jobs[0].id, jobs[1].id);
  assert.deepEqual(jobs[0].options, jobs[1].options);
  assert.equal(jobs[0].options.stages.initialize.n_smooth, 12);
  for (const [tool, { id }] of [['groomctl', jobs[0]], ['curl', jobs[1]]]) {
    const { code, output } = await bash(commandsOf({ method: 'DELETE', path: `/v1/jobs/${id}` }, { origin: daemon.url })[tool]);
    assert.equal(code, 0, output);
  }
  const spare = (await expect(daemon, 201, 'POST', '/v1/strands?unit=mm', { body: files['a hair.hair'] })).json.id;
  const { code, output } = await bash(commandsOf({ method: 'DELETE', path: `/v1/strands/${spare}` }, { origin: daemon.url }).groomctl);
  assert.equal(code, 0, output);
});

test('a retargeting, with a hairline in a file', async (t) => {
  const daemon = await startIdleDaemon(t), post = async (path, body) => (await expect(daemon, 201, 'POST', path, { body })).json.id;
  const strands = await post('/v1/strands', hair(30, 8)), [head, other] = [await post('/v1/heads?name=a', head_obj()), await post('/v1/heads?name=b&unit=cm', head_obj())];
  const groom = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom;
  const hairline = { kind: 'balding', points: [[0.1, 1.6, 0], [0, 1.65, 0.1], [-0.1, 1.6, 0]] }, options = { guides: 20, mode: 'global', sigma_root: 0.25 };
  for (const [subject, target] of [[{ strands }, { head: other, hairline }], [{ groom, dense: true, revision: 1 }, { head: other }], [{ groom }, { head: other }]]) {
    const made = [], body = { kind: 'retarget', ...subject, source: { head }, target, options };
    const folders = await both(t, daemon, { method: 'POST', path: '/v1/jobs', body }, {}, async () => {
      const { id } = (await daemon.json('/v1/jobs')).jobs[0], { kind, strands: of, groom: of_groom, dense, revision, source, targets, options: taken } = await daemon.json(`/v1/jobs/${id}`);
      made.push({ kind, of, of_groom, dense, revision, source, targets, taken });
    });
    assert.deepEqual(made[0], made[1]);
    assert.deepEqual([made[0].kind, made[0].source, made[0].taken.sigma_root, made[0].taken.guides], ['retarget', { head }, 0.25, 20]);
    assert.deepEqual(made[0].targets, [target]);
    assert.equal(existsSync(join(folders.groomctl, 'hairline.json')), Boolean(target.hairline));
  }
});

test('edits: each line makes the revision that the page made', async (t) => {
  const daemon = await startIdleDaemon(t);
  const fresh = async () => (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom;
  const other = await fresh();
  const guides = (at) => daemon.fetch(`${at}/guides?format=data`).then((answer) => answer.arrayBuffer()).then((bytes) => Buffer.from(bytes));
  const cases = {
    knob: () => ({ method: 'PATCH', path: '', type: json_patch, body: [{ op: 'add', path: '/operators/1/radius', value: 0.0075 }] }),
    'operator added': () => ({ method: 'PATCH', path: '', type: json_patch, body: [{ op: 'add', path: '/operators/-', value: { type: 'bend', angle: 0.4 } }] }),
    'operator removed': () => ({ method: 'PATCH', path: '', type: json_patch, body: [{ op: 'remove', path: '/operators/0' }] }),
    'operator moved': () => ({ method: 'PATCH', path: '', type: json_patch, body: [{ op: 'move', from: '/operators/2', path: '/operators/0' }] }),
    name: () => ({ method: 'PATCH', path: '', type: json_patch, body: [{ op: 'add', path: '/name', value: "Ann's $HOME \"cut\"" }] }),
    'merge patch': () => ({ method: 'PATCH', path: '', type: 'application/merge-patch+json', body: { name: 'merged' } }),
    ruffle: () => ({ method: 'POST', path: '/ruffle', body: { rho: 0.5, seed: 3, match_elements: 2, groups: 'all' } }),
    'ruffle by clusters': () => ({ method: 'POST', path: '/ruffle', body: { rho: 0.5, groups: { count: 2 } } }),
    sculpt: () => ({ method: 'POST', path: '/sculpt', body: { clusters: { count: 2, seed: 1 }, frames: [{ cluster: 0, at: 1, transform: [[1, 0, 0, 0.01], [0, 1, 0, 0], [0, 0, 1, 0]] }], stiffness: 10, layer: undefined, commit: true } }),
    interpolate: () => ({ method: 'POST', path: '/interpolate', body: { groom: other, t: 0.25 } }),
    'curl scale': () => ({ method: 'POST', path: '/curl-scale', body: { radius: 1.3, keep: 'turns', largest_radius: 0.05 } }),
    'curl scale on a ramp': () => ({ method: 'POST', path: '/curl-scale', body: { radius: 1.3, ramp_root: 0, ramp_tip: 1 } }),
    revert: () => ({ method: 'POST', path: '/revert', body: { revision: 1 } }),
  };
  for (const [name, make] of Object.entries(cases))
    await t.test(name, async () => {
      const results = [];
      for (const by of ['page', 'groomctl', 'curl']) {
        const id = await fresh(), given = make(), page_call = { ...given, path: `/v1/grooms/${id}${given.path}`, headers: { 'If-Match': '"1"' } };
        if (by === 'page') await call(daemon, page_call.method, page_call.path, { headers: { 'If-Match': '"1"', 'Content-Type': given.type ?? 'application/json' }, body: JSON.stringify(given.body) });
        else {
          const line = commandsOf(page_call, { origin: daemon.url })[by], { code, output } = await bash(line);
          assert.equal(code, 0, `${line}\n${output}`);
        }
        const { name: named, revision, operators } = await daemon.json(`/v1/grooms/${id}`);
        assert.equal(revision, 2, by);
        results.push({ named, operators });
      }
      assert.deepEqual(results[1], results[0], 'groomctl');
      assert.deepEqual(results[2], results[0], 'curl');
    });
  await t.test('guides', async () => {
    const id = await fresh(), at = `/v1/grooms/${id}`, first = await guides(at), moved = Buffer.from(first);
    const apart = (a, b) => { /* vertices of the first guide */
      let most = 0;
      for (let i = 8; i < 8 + 12 * 12; i += 4) most = Math.max(most, Math.abs(a.readFloatLE(i) - b.readFloatLE(i)));
      return most;
    };
    moved.writeFloatLE(moved.readFloatLE(8 + 5 * 12) + 0.02, 8 + 5 * 12);
    const { json: answer } = await expect(daemon, 201, 'PUT', `${at}/guides?format=data`, { headers: { 'If-Match': '"1"' }, body: moved }), kept = await guides(at);
    await expect(daemon, 201, 'POST', `${at}/revert`, { headers: { 'If-Match': '"2"' }, body: { revision: 1 } });
    const page_call = { method: 'PUT', path: `${at}/guides?format=data`, body: 'bytes', headers: { 'If-Match': '"3"' }, answer };
    const folder = temporaryFolder(t), { code, output } = await bash(commandsOf(page_call, { origin: daemon.url }).curl, folder);
    assert.equal(code, 0, output);
    assert.ok(apart(await guides(at), kept) < 0.002 && apart(kept, first) > 0.008, 'the moved guides, resampled');
    await bash(commandsOf(page_call, { origin: daemon.url }).groomctl, folder);
    assert.ok(apart(await guides(at), kept) < 0.002 && apart(kept, first) > 0.008, 'the moved guides, resampled');
    assert.equal((await daemon.json(at)).revision, 5);
  });
  await t.test('a whole groom removed', async () => {
    const id = await fresh();
    assert.equal((await bash(commandsOf({ method: 'DELETE', path: `/v1/grooms/${id}` }, { origin: daemon.url }).groomctl)).code, 0);
    await expect(daemon, 404, 'GET', `/v1/grooms/${id}`);
  });
});

test('what is taken home: both lines write the same file', async (t) => {
  const daemon = await startIdleDaemon(t), id = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom, at = `/v1/grooms/${id}`;
  const gets = ['usda', 'hair', 'ply', 'obj', 'data', 'json'].map((format) => `${at}/strands?format=${format}&unit=cm&up=z&revision=1&count=9`);
  gets.push(`${at}/guides?format=obj&unit=in&up=y&revision=1`, `${at}?revision=1`);
  gets.push(`${at}/preview.png?eye=0.4%2C1.8%2C0.9&target=0%2C1.6%2C0&size=96x64&light=front&revision=1`, `${at}/preview.png?view=back&size=64&revision=1`,
    `${at}/turntable.png?frames=2&size=64&azimuth=0.7854&elevation=0.2&revision=1`);
  for (const path of gets) {
    const folders = await both(t, daemon, { method: 'GET', path, file: "it's mine.out" });
    const [one, two] = Object.values(folders).map((folder) => readFileSync(join(folder, "it's mine.out")));
    assert.ok(one.length > 100, path);
    assert.deepEqual(one, two, path);
    assert.deepEqual(readdirSync(folders.curl), ["it's mine.out"]);
  }
});

test('a try under the hand is no action; words of a shell are quoted', () => {
  assert.equal(commandsOf({ method: 'POST', path: '/v1/grooms/grm_a/sculpt', body: { commit: false } }), null);
  assert.equal(commandsOf({ method: 'GET', path: '/v1/options' }), null);
  assert.equal(quoted("it's"), `'it'\\''s'`);
  assert.equal(quoted('plain-1.0/x'), 'plain-1.0/x');
  const { curl } = commandsOf({ method: 'DELETE', path: '/v1/jobs/job_a' }, { withToken: true });
  assert.equal(curl, 'curl -H "Authorization: Bearer $GROOMD_TOKEN" -X DELETE http://127.0.0.1:8080/v1/jobs/job_a');
});
