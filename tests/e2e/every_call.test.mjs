// Every operation of proto/openapi.yaml that is for people and scripts has a command of groomctl, and each
// answers: for people, and as JSON for scripts.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { groomctl, slowness, startDaemon, temporaryFolder } from '../support/daemon.mjs';
import { groom_document, hair, head_obj, startIdleDaemon } from '../support/api.mjs';
import { operations } from '../support/openapi.mjs';

/* For browsers, and between the daemon and its workers. */
const NOT_FOR_HANDS = /^(studio|studioFile|docsIndex|docsFile|statusPage|statusStyle|qualityPage|createSession|endSession|resumableUploads|work.*)$/;

test('each operation has its command', { timeout: 120000 * slowness }, async (t) => {
  const daemon = await startIdleDaemon(t), folder = temporaryFolder(t), path = (name) => join(folder, name), told = new Set();
  const env = { XDG_STATE_HOME: folder };
  const run = async (operation, args) => {
    for (const one of [operation].flat()) told.add(one);
    const result = await groomctl(daemon, args, { env });
    assert.equal(result.status, 0, `groomctl ${args.join(' ')}: ${result.stderr}${result.stdout}`);
    return result;
  };
  const json = async (operation, args) => (await run(operation, ['--json', ...args])).lines();
  writeFileSync(path('hair.hair'), hair(40, 12));
  writeFileSync(path('head.obj'), head_obj());
  writeFileSync(path('groom.json'), JSON.stringify(groom_document()));
  writeFileSync(path('body.json'), JSON.stringify({ name: 'patched' }));

  const [{ id: strands }] = await json('uploadStrands', ['upload', path('hair.hair')]);
  const [{ id: head }] = await json('uploadHead', ['upload-head', path('head.obj')]);
  await json(['createUpload', 'sendPiece'], ['upload', path('hair.hair'), '--resumable-from', '1', '--name', 'again']);
  const made = await daemon.fetch('/v1/uploads', { method: 'POST', headers: { 'Tus-Resumable': '1.0.0', 'Upload-Length': '100' } });
  const upload = made.headers.get('location').split('/').pop();
  assert.equal((await json('getUpload', ['get', upload]))[0].id, upload);
  await json('removeUpload', ['delete', upload]);
  for (const kind of ['strands', 'heads', 'jobs', 'grooms']) await json(`list${kind[0].toUpperCase()}${kind.slice(1)}`, ['list', kind]);
  await json('getStrands', ['get', strands]);
  await json('getHead', ['get', head]);
  await json('getStrandsData', ['export', strands, '-o', path('few.obj'), '--count', '5', '--vertices', '6']);
  await json('getHeadData', ['export', head, '-o', path('back.obj')]);
  assert.deepEqual(readFileSync(path('back.obj')), readFileSync(path('head.obj')));

  const [job] = await json('createJob', ['fit', strands, '--head', head, '--priority', '-3']);
  await json('getJob', ['status', job.id]);
  await json('jobLosses', ['losses', job.id]);
  await json('jobDeliveries', ['deliveries', job.id]);
  await run('cancelJob', ['cancel', job.id]);
  const watched = await groomctl(daemon, ['--json', 'watch', job.id]);
  told.add('jobEvents');
  assert.match(watched.stdout, /cancelled/);

  assert.match((await run([], ['watch', '--all'])).stdout, /no job runs/);
  assert.equal((await groomctl(daemon, ['watch', '--all', job.id])).status, 2);

  const [{ groom }] = await json('importGroom', ['import', path('groom.json')]);
  await json('getGroom', ['get', groom]);
  await json('patchGroom', ['set', groom, '/operators/1/radius=0.006']);
  await json('patchGroom', ['patch', groom, path('body.json')]);
  await run('getGroomStrands', ['export', groom, '-o', path('dense.hair')]);
  await run('getGuides', ['export', groom, '--guides', '-o', path('guides.json'), '--unit', 'cm', '--up', 'z']);
  const [{ revision }] = await json('setGuides', ['set-guides', groom, path('guides.json'), '--unit', 'cm', '--up', 'z']);
  assert.equal(revision, 4);
  await json('listRevisions', ['revisions', groom, '--limit', '2']);
  await json('revertGroom', ['revert', groom, '1']);
  await run('previewGroom', ['preview', groom, '-o', path('a.png'), '--size', '64']);
  await run('turntableGroom', ['turntable', groom, '-o', path('b.png'), '--size', '64', '--frames', '2']);
  for (const [kind, id] of [['Groom', groom], ['Strands', strands]]) {
    await json(`analyse${kind}`, ['analyze', id]);
    await json(`cluster${kind}`, ['clusters', id, '--count', '2']);
    await json(`ruffle${kind}`, ['ruffle', id, '--rho', '0.2']);
    await json(`sculpt${kind}`, ['sculpt', id, '--anchor', '0,1,0.01,1.5,0.02']);
    await json(`interpolate${kind}`, ['interpolate', id, '--groom', groom, '--t', '0.2']);
    await json(`curlScale${kind}`, ['curl-scale', id, '--radius', '1.2']);
  }
  await run('analyseGroom', ['analyze', groom, '--binary', path('curl.bin')]);
  await json('groomQuality', ['compare', groom, strands]);
  await json('strandsQuality', ['compare', strands, groom]);
  await run('qualityPicture', ['compare', groom, strands, '--picture', path('c.png'), '--of', 'target', '--size', '64']);

  await json(['health', 'ready'], ['health']);
  await json('options', ['options']);
  await json('getSession', ['whoami']);
  await json('listAudit', ['audit', '--limit', '3']);
  assert.match((await run('metrics', ['metrics'])).stdout, /^# (HELP|TYPE) /m);
  assert.match((await run('openapi', ['openapi'])).stdout, /"openapi"/);
  for (const [operation, id] of [['removeGroom', groom], ['removeHead', head]]) await json(operation, ['delete', id]);
  const [{ id: spare }] = await json('uploadStrands', ['upload', path('hair.hair'), '--unit', 'cm']);
  await json('removeStrands', ['delete', spare]);

  /* needs a capture with a hairline: tests/api/retarget.test.mjs has one */
  await run('headHairline', ['hairline', '--help']);

  /* the same for people: words, not JSON */
  for (const args of [['clusters', strands], ['audit'], ['list', 'strands'], ['analyze', strands, '--count', '10']])
    assert.doesNotMatch((await run([], args)).stdout, /^[{[]/, args.join(' '));
  const missing = operations.map(({ operation }) => operation.operationId).filter((id) => !told.has(id) && !NOT_FOR_HANDS.test(id));
  assert.deepEqual(missing, [], 'operations without a command');
});

test('what stands at the address is no groomd: said so', async (t) => {
  const { createServer } = await import('node:http');
  const server = createServer((_, answer) => { answer.writeHead(404, { 'Content-Type': 'text/html' }); answer.end('<h1>no</h1>'); }).listen(0, '127.0.0.1');
  t.after(() => server.close());
  await new Promise((done) => server.once('listening', done));
  const { status, stderr } = await groomctl(null, ['--server', `http://127.0.0.1:${server.address().port}`, 'list', 'jobs']);
  assert.equal(status, 1);
  assert.match(stderr, /not as a groomd does/);
});

test('a name that is mistyped finds the one that was meant', async () => {
  assert.match((await groomctl(null, ['exprot', 'grm_x'])).stderr, /no command "exprot"; export is one/);
  assert.match((await groomctl(null, ['export', 'grm_x', '--outptu', 'x'])).stderr, /--output is one/);
});

test('hair that lies apart from its head is pointed out', async (t) => {
  const daemon = await startIdleDaemon(t), folder = temporaryFolder(t), strands = join(folder, 'a.hair'), head = join(folder, 'a.obj');
  writeFileSync(strands, hair(40, 12));
  writeFileSync(head, head_obj());
  assert.match((await groomctl(daemon, ['fit', strands, '--head', head, '--head-up', 'z'])).stderr, /hint: .*other up axis/);
  assert.doesNotMatch((await groomctl(daemon, ['fit', strands, '--head', head])).stderr, /hint/);
});
