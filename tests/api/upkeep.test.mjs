// groomd check and groomd backup, of a daemon that runs and of one that does not; restoring.
import test from 'node:test';
import assert from 'node:assert/strict';
import { appendFileSync, existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync, truncateSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { build, Daemon, run, startDaemon, temporaryFolder, until } from '../support/daemon.mjs';
import { call, expect, groom_document, hair, head_obj, startIdleDaemon, submit } from '../support/api.mjs';

const groomd = (args) => run(join(build, 'groomd'), args);
const check = (data) => groomd(['check', '--data', data]);
const version = { 'Tus-Resumable': '1.0.0' };
const patch = { ...version, 'Content-Type': 'application/offset+octet-stream' };
const blob_path = (data, sha256) => join(data, 'blobs', sha256.slice(0, 2), sha256);

/** Something of everything: what a client was told, by target. */
async function furnish(daemon) {
  const strands = (await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(40, 10) })).json;
  const head = (await expect(daemon, 201, 'POST', '/v1/heads', { body: head_obj() })).json;
  const groom = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom;
  await expect(daemon, 201, 'PATCH', `/v1/grooms/${groom}`, { headers: { 'Content-Type': 'application/merge-patch+json', 'If-Match': '"1"' }, body: { name: 'two' } });
  const upload = (await expect(daemon, 201, 'POST', '/v1/uploads', { headers: { ...version, 'Upload-Length': '10' } })).headers.get('location');
  await expect(daemon, 204, 'PATCH', upload, { headers: { ...patch, 'Upload-Offset': '0' }, body: '12345' });
  const targets = [`/v1/strands/${strands.id}`, `/v1/strands/${strands.id}/data`, `/v1/heads/${head.id}/data`, `/v1/grooms/${groom}`, `/v1/grooms/${groom}?revision=1`, upload];
  const told = new Map();
  for (const target of targets) told.set(target, (await expect(daemon, 200, 'GET', target)).bytes);
  return { strands, head, groom, upload, told };
}

/** All that was told is there. */
async function verify(daemon, told) {
  for (const [target, bytes] of told) assert.deepEqual((await expect(daemon, 200, 'GET', target)).bytes, bytes, target);
}

async function start_on(t, data) {
  const folder = mkdtempSync(join(tmpdir(), 'groomd-restored-'));
  const daemon = new Daemon(folder, [], {});
  daemon.data = data;
  t.after(async () => { await daemon.stop(); daemon.check_logs(); rmSync(folder, { recursive: true, force: true }); });
  return daemon.start();
}

test('a backup of a daemon at work is a data folder of its own', async (t) => {
  const daemon = await startIdleDaemon(t), folder = temporaryFolder(t);
  const { strands, told } = await furnish(daemon);
  const job = await submit(daemon);
  writeFileSync(join(daemon.data, 'tokens'), 'kept', { mode: 0o600 });
  // uploads, edits and removals go on all the while
  let over = false, n = 0;
  const busy = (async () => {
    for (let i = 41; !over; i++, n++) {
      const { id } = (await call(daemon, 'POST', '/v1/strands', { body: hair(i, 10) })).json;
      await call(daemon, 'POST', '/v1/grooms', { body: groom_document() });
      if (i % 2) await call(daemon, 'DELETE', `/v1/strands/${id}`);
    }
  })();
  const places = [];
  await until('it is at work', () => n > 0);
  for (let i = 0; i < 3; i++) {
    const place = join(folder, `backup-${i}`);
    const { status, stdout, stderr } = await groomd(['backup', place, '--data', daemon.data, ...(i ? ['--copy'] : [])]);
    assert.equal(status, 0, stderr);
    assert.match(stdout, /\d+ blobs of .* 1 uploads under way/);
    places.push(place);
    const clean = await check(daemon.data);
    assert.equal(clean.status, 0, clean.stdout + clean.stderr);
  }
  await until('something went on meanwhile', () => n > 2);
  over = true;
  await busy;
  assert.equal(statSync(blob_path(places[0], strands.sha256)).ino, statSync(blob_path(daemon.data, strands.sha256)).ino, 'linked');
  assert.notEqual(statSync(blob_path(places[1], strands.sha256)).ino, statSync(blob_path(daemon.data, strands.sha256)).ino, 'copied');
  assert.equal(readFileSync(join(places[0], 'tokens'), 'utf8'), 'kept');
  assert.equal(statSync(join(places[0], 'tokens')).mode & 0o777, 0o600);
  assert.equal((await groomd(['backup', places[0], '--data', daemon.data])).status, 1, 'there already');
  await daemon.stop();
  for (const place of places) {
    const { status, stdout, stderr } = await check(place);
    assert.equal(status, 0, stdout + stderr);
    assert.match(stdout, /^0 problems; [1-9]/m);
    assert.ok(!existsSync(`${place}.partial`));
  }
  const restored = await start_on(t, places[2]);
  await verify(restored, told);
  assert.ok(['queued', 'running'].includes((await expect(restored, 200, 'GET', `/v1/jobs/${job.id}`)).json.state));
  await expect(restored, 204, 'PATCH', [...told.keys()].at(-1), { headers: { ...patch, 'Upload-Offset': '5' }, body: '67890' });
});

test('without a daemon, and after SIGKILL', async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t);
  const { told } = await furnish(daemon);
  await daemon.kill();
  assert.equal((await check(daemon.data)).status, 0);
  const place = join(folder, 'backup');
  const { status, stderr } = await groomd(['backup', '--copy', place, '--data', daemon.data]);
  assert.equal(status, 0, stderr);
  await daemon.start();
  await verify(daemon, told);
  await verify(await start_on(t, place), told);
});

test('check says what is wrong', async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t);
  const { strands, head, upload } = await furnish(daemon);
  truncateSync(blob_path(daemon.data, strands.sha256), 100);
  const running = await check(daemon.data);
  assert.equal(running.status, 1);
  assert.match(running.stdout, new RegExp(`problem: the blob ${strands.sha256} of ${strands.id} is damaged \\(100 bytes of \\d+\\): upload the file again`));
  assert.match(running.stdout, /^1 problems/m);
  const refused = await groomd(['backup', '--copy', join(folder, 'backup'), '--data', daemon.data]);
  assert.equal(refused.status, 1);
  assert.match(refused.stderr, /is damaged; groomd check says all that is/);
  assert.deepEqual(readdirSync(folder), [], 'nothing half made is left');
  await t.test('uploading the same file again mends it', async () => {
    await expect(daemon, 200, 'POST', '/v1/strands', { body: hair(40, 10) });
    assert.equal((await check(daemon.data)).status, 0);
  });
  await daemon.stop();
  rmSync(blob_path(daemon.data, head.sha256));
  truncateSync(join(daemon.data, upload.replace('/v1/', '')), 2);
  writeFileSync(blob_path(daemon.data, `${'0'.repeat(64)}`), 'nobody\'s');
  const stopped = await check(daemon.data);
  assert.equal(stopped.status, 1);
  assert.match(stopped.stdout, new RegExp(`problem: the blob ${head.sha256} of ${head.id} is missing`));
  assert.match(stopped.stdout, /problem: the upload upl_\w+ has 2 bytes, not the 5 that its sender was told/);
  await t.test('a damaged database', async () => {
    const path = join(daemon.data, 'groomd.db'), bytes = readFileSync(path);
    for (let at = 4096; at + 4096 <= bytes.length; at += 4096) bytes.fill(0x5a, at, at + 64);
    writeFileSync(path, bytes);
    const { status, stdout } = await check(daemon.data);
    assert.equal(status, 1);
    assert.match(stdout, /^problem: the database/m);
    appendFileSync(path, '');
  });
  await t.test('wrong usage', async () => {
    assert.equal((await groomd(['check', 'x'])).status, 2);
    assert.equal((await groomd(['backup'])).status, 2);
    assert.equal((await groomd(['backup', 'a', 'b'])).status, 2);
    assert.equal((await groomd(['check', '--help'])).status, 0);
    assert.equal((await check(join(folder, 'nothing'))).status, 1);
    assert.ok(!existsSync(join(folder, 'nothing')), 'nothing is made');
  });
  // the daemon of this test has ended well; its folder is not to be started on again
  await until('it has ended', () => daemon.child.exitCode !== null);
});
