// Uploads that survive a bad line: tus 1.0 as its own client speaks it, and what it must refuse.
import test from 'node:test';
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readdirSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { join } from 'node:path';
import * as tus from 'tus-js-client';
import { groomctl, startDaemon, temporaryFolder, until } from '../support/daemon.mjs';
import { call, expect, hair, head_obj, refused } from '../support/api.mjs';

const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');
const base64 = (algorithm, bytes) => createHash(algorithm).update(bytes).digest('base64');
const version = { 'Tus-Resumable': '1.0.0' };
const piece = { ...version, 'Content-Type': 'application/offset+octet-stream' };
const files_of = (daemon) => readdirSync(join(daemon.data, 'uploads'));

/** tus-js-client to its end: the URL of the upload. */
function send(daemon, bytes, options = {}) {
  return new Promise((done, fail) => {
    const upload = new tus.Upload(bytes, {
      endpoint: new URL('/v1/uploads', daemon.url).href, retryDelays: Array(40).fill(50), chunkSize: 1 << 18,
      metadata: { filename: 'hair äöü.hair' }, onError: fail, onSuccess: () => done(new URL(upload.url).pathname), ...options,
    });
    upload.start();
  });
}

const create = async (daemon, n) =>
  (await expect(daemon, 201, 'POST', '/v1/uploads', { headers: { ...version, 'Upload-Length': `${n}` } })).headers.get('location');
const patch = (daemon, status, url, offset, body, headers = {}) =>
  expect(daemon, status, 'PATCH', url, { headers: { ...piece, 'Upload-Offset': `${offset}`, ...headers }, body });
const offset_of = async (daemon, url) => Number((await expect(daemon, 200, 'HEAD', url, { headers: version })).headers.get('upload-offset'));
const id_of = (url) => url.split('/').pop();

/** A PATCH that stays open: { socket, write }. */
async function open_patch(daemon, url, offset, n) {
  const { hostname, port } = new URL(daemon.url);
  const socket = net.connect(Number(port), hostname).on('error', () => {});
  await new Promise((done) => socket.on('connect', done));
  const write = (bytes) => new Promise((done) => socket.write(bytes, done));
  await write(`PATCH ${url} HTTP/1.1\r\nHost: localhost\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: ${offset}\r\nContent-Type: application/offset+octet-stream\r\nContent-Length: ${n}\r\n\r\n`);
  return { socket, write };
}

/** A line that breaks after so many bytes, every time. */
async function bad_line(t, daemon, n_bytes) {
  const { hostname, port } = new URL(daemon.url);
  const counts = { connections: 0, stalls: false };
  const proxy = net.createServer((client) => {
    const server = net.connect(Number(port), hostname);
    let left = n_bytes;
    counts.connections++;
    const cut = () => { client.destroy(); server.destroy(); };
    client.on('data', (bytes) => {
      server.write(bytes.subarray(0, left));
      if ((left -= bytes.length) >= 0) return;
      client.pause();
      if (!counts.stalls) setTimeout(cut, 5);
    }).on('error', cut).on('close', cut);
    server.on('data', (bytes) => client.write(bytes)).on('error', cut).on('close', cut);
  });
  await new Promise((done) => proxy.listen(0, '127.0.0.1', done));
  t.after(() => proxy.close());
  return { url: `http://127.0.0.1:${proxy.address().port}`, counts };
}

test('tus-js-client uploads, and the bytes become strands', async (t) => {
  const daemon = await startDaemon(t);
  const bytes = hair(2000, 50);
  const progress = [];
  const url = await send(daemon, bytes, { onChunkComplete: (n, sent, total) => progress.push([sent, total]) });
  assert.deepEqual(progress.at(-1), [bytes.length, bytes.length]);
  assert.ok(progress.length > 3);
  const { json } = await expect(daemon, 200, 'GET', url);
  assert.equal(json.complete, true);
  assert.equal(json.bytes, bytes.length);
  assert.equal(json.metadata, `filename ${Buffer.from('hair äöü.hair').toString('base64')}`);
  const strands = (await expect(daemon, 201, 'POST', `/v1/strands?upload=${id_of(url)}&unit=cm&name=x`)).json;
  assert.equal(strands.sha256, sha256(bytes));
  assert.equal(strands.strands, 2000);
  assert.equal((await expect(daemon, 200, 'POST', '/v1/strands?unit=cm', { body: bytes })).json.id, strands.id, 'as if uploaded plainly');
  await t.test('who did not hear the answer asks again; another reading of the same bytes is other strands', async () => {
    assert.equal((await expect(daemon, 200, 'POST', `/v1/strands?upload=${id_of(url)}&unit=cm`)).json.id, strands.id);
    assert.notEqual((await expect(daemon, 201, 'POST', `/v1/strands?upload=${id_of(url)}&unit=in`)).json.id, strands.id);
    await patch(daemon, 409, url, bytes.length, 'x');
  });
  await t.test('what was made of it stays when it goes', async () => {
    assert.deepEqual(files_of(daemon), [], 'its bytes are a blob');
    await expect(daemon, 204, 'DELETE', url, { headers: version });
    await refused(daemon, 404, 'not-found', 'DELETE', url, { headers: version });
    await refused(daemon, 404, 'not-found', 'POST', `/v1/strands?upload=${id_of(url)}`);
    assert.equal((await expect(daemon, 200, 'GET', `/v1/strands/${strands.id}/data?unit=cm`)).bytes.length, bytes.length);
  });
  await t.test('heads too; a body beside upload= is refused', async () => {
    const head = await send(daemon, Buffer.from(head_obj()));
    assert.ok((await expect(daemon, 201, 'POST', `/v1/heads?upload=${id_of(head)}`)).json.triangles > 100);
    await refused(daemon, 400, 'invalid-argument', 'POST', `/v1/heads?upload=${id_of(head)}`, { body: 'x', problem: { parameter: 'upload' } });
  });
  await t.test('a file that is no strands can be read in another way', async () => {
    const wrong = await send(daemon, Buffer.from(head_obj()));
    assert.ok((await call(daemon, 'POST', `/v1/strands?upload=${id_of(wrong)}&format=hair`)).status >= 400);
    await expect(daemon, 200, 'POST', `/v1/heads?upload=${id_of(wrong)}`);
  });
  await t.test('creation with the first piece', async () => {
    const other = hair(10, 12);
    const made = await expect(daemon, 201, 'POST', '/v1/uploads', { headers: { ...piece, 'Upload-Length': `${other.length}` }, body: other.subarray(0, 500) });
    assert.equal(made.headers.get('upload-offset'), '500');
    await patch(daemon, 204, made.headers.get('location'), 500, other.subarray(500));
    const whole = await send(daemon, hair(11, 12), { uploadDataDuringCreation: true });
    for (const one of [made.headers.get('location'), whole]) await expect(daemon, 201, 'POST', `/v1/strands?upload=${id_of(one)}`);
  });
});

test('a line that breaks again and again, and a daemon that is killed', async (t) => {
  const daemon = await startDaemon(t);
  const bytes = hair(4000, 100);
  await t.test('the client goes on from where the last byte arrived', async () => {
    const line = await bad_line(t, daemon, 700000);
    const url = await send(line, bytes, { chunkSize: Infinity });
    assert.ok(line.counts.connections > bytes.length / 1000000, `${line.counts.connections} connections`);
    assert.equal((await expect(daemon, 201, 'POST', `/v1/strands?upload=${id_of(url)}`)).json.sha256, sha256(bytes));
  });
  await t.test('what was acknowledged is there after SIGKILL', async () => {
    const other = hair(4001, 100), url = await create(daemon, other.length);
    for (let at = 0; at < other.length;) {
      const n = Math.min(900001, other.length - at);
      await patch(daemon, 204, url, at, other.subarray(at, at + n));
      at += n;
      await daemon.kill();
      await daemon.start();
      assert.equal(await offset_of(daemon, url), at);
    }
    assert.equal((await expect(daemon, 201, 'POST', `/v1/strands?upload=${id_of(url)}`)).json.sha256, sha256(other));
  });
  await t.test('most of a piece that was under way is there, too', async () => {
    const other = hair(3001, 100), url = await create(daemon, other.length);
    const { write } = await open_patch(daemon, url, 0, other.length);
    await write(other.subarray(0, 2000000));
    await until('the keeper has counted them', async () => (await offset_of(daemon, url)) === 2000000);
    await write(other.subarray(2000000, 2100000));
    await daemon.kill();
    await daemon.start();
    const at = await offset_of(daemon, url);
    assert.ok(at >= 2000000, String(at));
    assert.deepEqual((await send(daemon, other, { uploadUrl: new URL(url, daemon.url).href })), url);
    assert.equal((await expect(daemon, 201, 'POST', `/v1/strands?upload=${id_of(url)}`)).json.sha256, sha256(other));
  });
  await t.test('a line that broke counts as far as it came', async () => {
    const url = await create(daemon, bytes.length);
    const { socket, write } = await open_patch(daemon, url, 0, bytes.length);
    await write(bytes.subarray(0, 123456));
    await until('all has come', async () => (await offset_of(daemon, url)) === 123456);
    socket.resetAndDestroy();
    await until('the daemon has let go of it', async () => (await call(daemon, 'PATCH', url, { headers: { ...piece, 'Upload-Offset': '123456' }, body: bytes.subarray(123456) })).status === 204);
    assert.equal((await expect(daemon, 200, 'POST', `/v1/strands?upload=${id_of(url)}`)).json.sha256, sha256(bytes));
  });
});

test('checksums and digests', async (t) => {
  const daemon = await startDaemon(t);
  const bytes = hair(30, 20), half = bytes.subarray(0, 3000), rest = bytes.subarray(3000);
  const url = await create(daemon, bytes.length);
  await patch(daemon, 460, url, 0, half, { 'Upload-Checksum': `sha1 ${base64('sha1', rest)}` });
  assert.equal(await offset_of(daemon, url), 0, 'nothing of it is kept');
  await patch(daemon, 400, url, 0, half, { 'Upload-Checksum': `md5 ${base64('md5', half)}` });
  await patch(daemon, 400, url, 0, half, { 'Upload-Checksum': `sha1 ${base64('sha256', half)}` });
  await patch(daemon, 400, url, 0, half, { 'Upload-Checksum': 'sha1' });
  await patch(daemon, 400, url, 0, half, { 'Content-Digest': `sha-256=:${base64('sha256', rest)}:` });
  await patch(daemon, 204, url, 0, half, { 'Upload-Checksum': `sha1 ${base64('sha1', half)}` });
  await patch(daemon, 204, url, 3000, rest, { 'Upload-Checksum': `sha256 ${base64('sha256', rest)}` });
  const { json } = await expect(daemon, 201, 'POST', `/v1/strands?upload=${id_of(url)}`);
  const digest = `sha-256=:${base64('sha256', bytes)}:`, other = `sha-256=:${base64('sha256', half)}:`;
  assert.equal((await expect(daemon, 200, 'GET', `/v1/strands/${json.id}/data`)).headers.get('repr-digest'), digest);
  await t.test('a broken line says nothing of a piece with a checksum', async () => {
    const broken = await create(daemon, bytes.length);
    const { hostname, port } = new URL(daemon.url);
    const socket = net.connect(Number(port), hostname).on('error', () => {});
    socket.write(`PATCH ${broken} HTTP/1.1\r\nHost: localhost\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: 0\r\nUpload-Checksum: sha1 ${base64('sha1', bytes)}\r\nContent-Type: application/offset+octet-stream\r\nContent-Length: ${bytes.length}\r\n\r\n`);
    await new Promise((done) => socket.write(half, done));
    await new Promise((done) => setTimeout(done, 1500));
    assert.equal(await offset_of(daemon, broken), 0);
    socket.resetAndDestroy();
  });
  await t.test('Content-Digest of plain uploads', async () => {
    const fresh = hair(31, 20), right = `sha-256=:${base64('sha256', fresh)}:`;
    await refused(daemon, 400, 'digest-mismatch', 'POST', '/v1/strands', { body: fresh, headers: { 'Content-Digest': other },
      problem: { detail: new RegExp(`${other}.*${right}`.replace(/[+/.]/g, '\\$&').replace('\\.*', '.*')) } });
    await refused(daemon, 400, 'bad-digest', 'POST', '/v1/strands', { body: fresh, headers: { 'Content-Digest': 'sha-256=abc' } });
    await expect(daemon, 201, 'POST', '/v1/strands', { body: fresh, headers: { 'Content-Digest': `sha-512=:AAAA:, ${right}` } });
    await expect(daemon, 200, 'POST', '/v1/strands', { body: fresh, headers: { 'Content-Digest': 'sha-512=:AAAA:' } });
    const job = { kind: 'fit', strands: json.id };
    await refused(daemon, 400, 'digest-mismatch', 'POST', '/v1/jobs', { body: job, headers: { 'Content-Digest': other } });
    await refused(daemon, 400, 'digest-mismatch', 'POST', '/v1/grooms', { body: '{}', headers: { 'Content-Digest': other } });
  });
});

test('what is refused', async (t) => {
  const daemon = await startDaemon(t, { args: ['--max-upload', '1M'] });
  const options = await expect(daemon, 204, 'OPTIONS', '/v1/uploads');
  assert.equal(options.headers.get('tus-max-size'), '1048576');
  for (const extension of ['creation', 'checksum', 'expiration', 'termination'])
    assert.ok(options.headers.get('tus-extension').split(',').includes(extension));
  const post = (status, name, headers, more = {}) => refused(daemon, status, name, 'POST', '/v1/uploads', { headers, ...more });
  assert.equal((await post(412, 'tus-version', { 'Tus-Resumable': '0.2.2', 'Upload-Length': '5' })).headers.get('tus-version'), '1.0.0');
  await post(412, 'tus-version', { 'Upload-Length': '5' });
  await post(400, 'bad-request', version);
  await post(400, 'bad-request', { ...version, 'Upload-Length': '-5' });
  await post(400, 'bad-request', { ...version, 'Upload-Length': '5', 'Upload-Metadata': 'name <>' });
  await post(400, 'bad-request', { ...version, 'Upload-Length': '5', 'Upload-Metadata': 'a QQ==,,b QQ==' });
  await post(413, 'too-large', { ...version, 'Upload-Length': '1048577' });
  await post(415, 'unsupported-media-type', { ...version, 'Upload-Length': '5' }, { body: '12345' });
  await post(413, 'too-large', { ...piece, 'Upload-Length': '5' }, { body: '123456' });

  const url = await create(daemon, 1000);
  const wrong = (status, name, headers, body = 'x'.repeat(10)) => refused(daemon, status, name, 'PATCH', url, { headers, body });
  await wrong(412, 'tus-version', { ...piece, 'Tus-Resumable': '2.0.0', 'Upload-Offset': '0' });
  await wrong(415, 'unsupported-media-type', { ...version, 'Upload-Offset': '0', 'Content-Type': 'application/octet-stream' });
  await wrong(400, 'bad-request', piece);
  await wrong(409, 'conflict', { ...piece, 'Upload-Offset': '5' });
  await wrong(413, 'too-large', { ...piece, 'Upload-Offset': '0' }, 'x'.repeat(1001));
  await refused(daemon, 409, 'conflict', 'POST', `/v1/strands?upload=${id_of(url)}`, { problem: { detail: /0 of its 1000 bytes/ } });
  for (const method of ['PATCH', 'GET', 'DELETE'])
    await refused(daemon, 404, 'not-found', method, '/v1/uploads/upl_nothing', { headers: { ...piece, 'Upload-Offset': '0' } });
  await refused(daemon, 404, 'not-found', 'GET', '/v1/uploads/..%2f..%2fgroomd.db');
  await t.test('chunked, and more than it is to have', async () => {
    const stream = new ReadableStream({ start(controller) { controller.enqueue(Buffer.alloc(600)); controller.enqueue(Buffer.alloc(600)); controller.close(); } });
    await expect(daemon, 413, 'PATCH', url, { headers: { ...piece, 'Upload-Offset': '0' }, body: stream, duplex: 'half' });
    assert.ok((await offset_of(daemon, url)) <= 1000);
  });
  await t.test('POST in the name of PATCH', async () => {
    const other = await create(daemon, 4);
    await daemon.fetch(other, { method: 'POST', headers: { ...piece, 'Upload-Offset': '0', 'X-HTTP-Method-Override': 'PATCH' }, body: 'abcd' });
    assert.equal(await offset_of(daemon, other), 4);
  });
  await t.test('two at once: one is refused; one that is silent gives way; one that is removed ends', async () => {
    const other = await create(daemon, 100000), body = Buffer.alloc(100000, 7);
    const first = await open_patch(daemon, other, 0, 100000);
    await first.write(body.subarray(0, 20));
    await until('it has come', async () => (await offset_of(daemon, other)) === 20);
    const busy = await refused(daemon, 423, 'locked', 'PATCH', other, { headers: { ...piece, 'Upload-Offset': '20' }, body: 'x' });
    assert.equal(busy.headers.get('retry-after'), '2');
    await until('the silent one gives way', async () => (await call(daemon, 'PATCH', other, { headers: { ...piece, 'Upload-Offset': '20' }, body: body.subarray(20, 50) })).status === 204);
    await first.write(body.subarray(20)).catch(() => {});
    assert.equal(await offset_of(daemon, other), 50, 'what the former one sends does not count');
    const second = await open_patch(daemon, other, 50, 99950);
    await second.write(body.subarray(50, 99));
    await expect(daemon, 204, 'DELETE', other, { headers: version });
    await second.write(body.subarray(99, 500)).catch(() => {});
    await expect(daemon, 404, 'HEAD', other, { headers: version });
    first.socket.destroy(); second.socket.destroy();
  });
});

test('groomctl upload goes on over a bad line, and after Ctrl-C', async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t);
  const bytes = hair(4000, 100), path = join(folder, 'big.hair');
  writeFileSync(path, bytes);
  const line = await bad_line(t, daemon, 900000);
  const ctl = (args, options = {}) => groomctl(line, args, { ...options, env: { XDG_STATE_HOME: folder } });
  const remembered = () => readdirSync(join(folder, 'groomctl'));
  await t.test('a line that breaks every megabyte', async () => {
    const { status, stdout, stderr } = await ctl(['--json', 'upload', path, '--resumable-from', '1000', '--unit', 'cm']);
    assert.equal(status, 0, stderr);
    assert.equal(JSON.parse(stdout).sha256, sha256(bytes));
    assert.equal(JSON.parse(stdout).name, 'big.hair');
    assert.ok(line.counts.connections > 4);
    assert.deepEqual(remembered(), [], 'nothing is left to go on with');
  });
  await t.test('interrupted and done again', async () => {
    line.counts.stalls = true;
    const first = await ctl(['upload', path, '--resumable-from', '1000'], {
      on_start: (child) => until('some of it is there', () => files_of(daemon).length > 0)
        .then(() => new Promise((done) => setTimeout(done, 1500))).then(() => child.kill('SIGINT')),
    });
    assert.equal(first.status, 130);
    assert.match(first.stderr, /interrupted; the same command goes on where this one ended/);
    assert.equal(remembered().length, 1);
    line.counts.stalls = false;
    const { status, stdout, stderr } = await ctl(['upload', path, '--resumable-from', '1000']);
    assert.equal(status, 0, stderr);
    assert.match(stderr, /going on from 0\.9 of 4\.8 MB/);
    assert.match(stdout, /^str_\S+ {2}4000 strands/);
    assert.deepEqual(remembered(), []);
  });
  await t.test('an upload that the server has dropped begins anew', async () => {
    line.counts.stalls = true;
    await ctl(['upload', path, '--resumable-from', '1000'], {
      on_start: (child) => until('some of it is there', () => files_of(daemon).length > 0).then(() => child.kill('SIGINT')),
    });
    for (const name of files_of(daemon)) await expect(daemon, 204, 'DELETE', `/v1/uploads/${name}`, { headers: version });
    line.counts.stalls = false;
    assert.equal((await ctl(['upload', path, '--resumable-from', '1000'])).status, 0);
  });
});
