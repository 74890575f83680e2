// Uploads: strands and heads, good ones, bad ones, large ones, broken ones.
import test from 'node:test';
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readdirSync } from 'node:fs';
import net from 'node:net';
import { join } from 'node:path';
import { startDaemon, until } from '../support/daemon.mjs';
import { call, expect, hair, head_obj, points, raw, refused, strands_json } from '../support/api.mjs';

const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');
const blobs_of = (daemon) => readdirSync(join(daemon.data, 'blobs'), { recursive: true }).filter((name) => /[0-9a-f]{60}/.test(name));

test('strands go in and come out', async (t) => {
  const daemon = await startDaemon(t);
  const bytes = hair(20, 10);
  const first = await expect(daemon, 201, 'POST', '/v1/strands?name=a%20name', { body: bytes });
  const strands = first.json;
  assert.equal(first.headers.get('location'), `/v1/strands/${strands.id}`);
  assert.equal(strands.sha256, sha256(bytes));
  assert.equal(strands.strands, 20);
  assert.equal(strands.vertices, 200);
  assert.equal(strands.name, 'a name');
  assert.equal(strands.format, 'hair');
  assert.ok(Math.abs(strands.length.median - 0.2) < 0.1, JSON.stringify(strands.length));
  assert.ok(strands.bbox.max[1] <= 1.71);

  await t.test('the same bytes in the same reading are the same strands', async () => {
    assert.equal((await expect(daemon, 200, 'POST', '/v1/strands', { body: bytes })).json.id, strands.id);
    const cm = (await expect(daemon, 201, 'POST', '/v1/strands?unit=cm', { body: bytes })).json;
    assert.notEqual(cm.id, strands.id);
    assert.equal(cm.sha256, strands.sha256);
    assert.ok(Math.abs(cm.bbox.max[1] - strands.bbox.max[1] / 100) < 1e-6);
    const z = (await expect(daemon, 201, 'POST', '/v1/strands?up=z', { body: bytes })).json;
    assert.ok(Math.abs(z.bbox.max[1] - strands.bbox.max[2]) < 1e-6, '(x, y, z) with z up is (x, z, -y)');
  });
  await t.test('metadata, lists and conditions', async () => {
    const { json, headers } = await expect(daemon, 200, 'GET', `/v1/strands/${strands.id}`);
    assert.deepEqual(json, strands);
    await expect(daemon, 304, 'GET', `/v1/strands/${strands.id}`, { headers: { 'If-None-Match': headers.get('etag') } });
    const page = (await expect(daemon, 200, 'GET', '/v1/strands?limit=2')).json;
    assert.equal(page.strands.length, 2);
    const rest = (await expect(daemon, 200, 'GET', `/v1/strands?limit=2&before=${page.next}`)).json;
    assert.deepEqual(rest.strands.map(({ id }) => id), [strands.id]);
    assert.equal(rest.next, null);
  });
  await t.test('the very bytes where nothing is to be converted, in ranges too', async () => {
    const data = `/v1/strands/${strands.id}/data`;
    const all = await expect(daemon, 200, 'GET', data);
    assert.deepEqual(all.bytes, bytes);
    assert.equal(all.headers.get('content-disposition'), `attachment; filename="${strands.id}.hair"`);
    const part = await expect(daemon, 206, 'GET', data, { headers: { Range: 'bytes=4-7' } });
    assert.deepEqual(part.bytes, bytes.subarray(4, 8));
    assert.equal(part.headers.get('content-range'), `bytes 4-7/${bytes.length}`);
    assert.deepEqual((await expect(daemon, 206, 'GET', data, { headers: { Range: 'bytes=-5' } })).bytes, bytes.subarray(-5));
    assert.deepEqual((await expect(daemon, 206, 'GET', data, { headers: { Range: `bytes=${bytes.length - 2}-` } })).bytes, bytes.subarray(-2));
    await refused(daemon, 416, 'range-not-satisfiable', 'GET', data, { headers: { Range: `bytes=${bytes.length}-` } });
    assert.equal((await expect(daemon, 200, 'GET', data, { headers: { Range: 'bytes=9-2' } })).bytes.length, bytes.length);
    await expect(daemon, 200, 'GET', data, { headers: { Range: 'bytes=0-1', 'If-Range': '"another"' } });
    await expect(daemon, 304, 'GET', data, { headers: { 'If-None-Match': all.headers.get('etag') } });
    assert.equal((await expect(daemon, 200, 'HEAD', data)).headers.get('content-length'), String(bytes.length));
  });
  await t.test('converted to every format that can be written, and back', async () => {
    for (const format of ['hair', 'data', 'ply', 'obj', 'json']) {
      const file = await expect(daemon, 200, 'GET', `/v1/strands/${strands.id}/data?format=${format}&unit=cm&up=z`);
      const back = (await call(daemon, 'POST', '/v1/strands?unit=cm&up=z', { body: file.bytes })).json;
      assert.equal(back.strands, 20, format);
      assert.equal(back.vertices, 200, format);
      for (const side of ['min', 'max']) for (let i = 0; i < 3; i++)
        assert.ok(Math.abs(back.bbox[side][i] - strands.bbox[side][i]) < 1e-5, `${format} ${side} ${i}`);
    }
    assert.match((await expect(daemon, 200, 'GET', `/v1/strands/${strands.id}/data?format=usda`)).text, /^#usda 1\.0/);
  });
  await t.test('JSON strands', async () => {
    const { json } = await expect(daemon, 201, 'POST', '/v1/strands', { headers: { 'Content-Type': 'application/json' }, body: strands_json(points(5, 4)) });
    assert.equal(json.format, 'json');
    assert.equal(json.strands, 5);
  });
  await t.test('what cannot be used is dropped and counted', async () => {
    const broken = points(6, 5);
    broken[2][3][1] = NaN;
    const { json } = await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(6, 5, broken) });
    assert.equal(json.strands, 5);
    assert.equal(json.warnings.length, 1);
  });
});

test('bad strands are refused with a reason, and leave nothing', async (t) => {
  const daemon = await startDaemon(t);
  const bytes = hair(20, 10);
  const post = (status, name, query, options) => refused(daemon, status, name, 'POST', `/v1/strands${query}`, options);
  await post(422, 'truncated-file', '', { body: bytes.subarray(0, 1000), problem: { byte_offset: /^\d+$/, detail: /./ } });
  await post(415, 'unknown-format', '', { body: Buffer.from('neither hair nor anything') });
  await post(422, 'invalid-file', '?format=json', { body: '{"strands":[[[0,0,0],[0,1,]]]}', problem: { byte_offset: /^\d+$/ } });
  await post(422, 'empty', '', { body: '{"strands":[]}' });
  await post(400, 'invalid-argument', '', { problem: { detail: /the body is empty/ } });
  await post(400, 'invalid-argument', '?format=fbx', { body: bytes, problem: { parameter: 'format', detail: /hair/ } });
  await post(400, 'invalid-argument', '?format=usda', { body: bytes, problem: { parameter: 'format' } });
  await post(400, 'invalid-argument', '?unit=furlong', { body: bytes, problem: { parameter: 'unit' } });
  await post(400, 'invalid-argument', '?unit=-1', { body: bytes, problem: { parameter: 'unit' } });
  await post(400, 'invalid-argument', '?up=x', { body: bytes, problem: { parameter: 'up' } });
  await post(400, 'invalid-argument', `?name=${'n'.repeat(200)}`, { body: bytes, problem: { parameter: 'name' } });
  await post(400, 'invalid-argument', '?units=cm', { body: bytes, problem: { parameter: 'units' } });
  await post(415, 'unsupported-media-type', '', { body: bytes, headers: { 'Content-Type': 'multipart/form-data; boundary=x' }, problem: { detail: /data-binary/ } });
  await post(415, 'unsupported-media-type', '', { body: bytes, headers: { 'Content-Encoding': 'gzip' } });
  const deep = '['.repeat(1000) + ']'.repeat(1000);
  const { json } = await refused(daemon, 422, 'invalid-file', 'POST', '/v1/strands?format=json', { body: `{"strands":${deep}}` });
  assert.ok(json.detail);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/strands')).json.strands, []);
  assert.deepEqual(blobs_of(daemon), []);
  await refused(daemon, 404, 'not-found', 'GET', '/v1/strands/str_nothing');
  await refused(daemon, 404, 'not-found', 'GET', '/v1/strands/str_nothing/data');
});

test('too large is refused, whatever the sender says of its length', async (t) => {
  const daemon = await startDaemon(t, { args: ['--max-upload', '64K', '--max-body', '2K'] });
  await refused(daemon, 413, 'too-large', 'POST', '/v1/strands', { body: hair(1000, 10), problem: { detail: /65536 bytes \(--max-upload\)/ } });
  const stream = new ReadableStream({
    start(controller) { this.left = 100; controller.enqueue(hair(1000, 10).subarray(0, 4096)); },
    pull(controller) { if (this.left-- > 0) controller.enqueue(Buffer.alloc(4096)); else controller.close(); },
  });
  await refused(daemon, 413, 'too-large', 'POST', '/v1/strands', { body: stream, duplex: 'half' });
  await refused(daemon, 413, 'too-large', 'POST', '/v1/jobs', { body: { kind: 'x'.repeat(3000) }, problem: { detail: /2048 bytes \(--max-body\)/ } });
  const early = await raw(daemon, 'POST /v1/strands HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000000000\r\n\r\n');
  assert.match(early, /^HTTP\/1\.1 413 /);
  const polite = await raw(daemon, 'POST /v1/strands HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000000\r\nExpect: 100-continue\r\n\r\n');
  assert.match(polite, /^HTTP\/1\.1 413 /);
  assert.deepEqual(blobs_of(daemon), []);
  await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(100, 10) });
});

test('chunked bodies and bodies in drips are whole', async (t) => {
  const daemon = await startDaemon(t);
  const bytes = hair(30, 12);
  const stream = new ReadableStream({
    start() { this.at = 0; },
    pull(controller) {
      if (this.at >= bytes.length) { controller.close(); return; }
      controller.enqueue(bytes.subarray(this.at, this.at += 501));
    },
  });
  const { json } = await expect(daemon, 201, 'POST', '/v1/strands', { body: stream, duplex: 'half' });
  assert.equal(json.sha256, sha256(bytes));
});

test('an upload that breaks off is never visible', async (t) => {
  const daemon = await startDaemon(t);
  const { hostname, port } = new URL(daemon.url);
  const bytes = hair(2000, 50);
  for (const part of [0, 1, 200, bytes.length / 2, bytes.length - 1]) {
    const socket = net.connect(Number(port), hostname);
    await new Promise((done) => socket.on('connect', done));
    await new Promise((done) => socket.write(`POST /v1/strands HTTP/1.1\r\nHost: localhost\r\nContent-Length: ${bytes.length}\r\n\r\n`, done));
    await new Promise((done) => socket.write(bytes.subarray(0, part), done));
    await new Promise((done) => setTimeout(done, 50));
    socket.resetAndDestroy();
  }
  await until('the daemon has seen all five break off', () => (daemon.log().match(/"broken":true/g) ?? []).length === 5);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/strands')).json.strands, []);
  assert.deepEqual(blobs_of(daemon), []);
  await expect(daemon, 201, 'POST', '/v1/strands', { body: bytes });
});

test('the same upload many times at once is one', async (t) => {
  const daemon = await startDaemon(t);
  const bytes = hair(50, 20);
  const answers = await Promise.all(Array.from({ length: 12 }, () => call(daemon, 'POST', '/v1/strands', { body: bytes })));
  for (const { status } of answers) assert.ok(status === 200 || status === 201, String(status));
  assert.equal(new Set(answers.map(({ json }) => json.id)).size, 1);
  assert.equal(answers.filter(({ status }) => status === 201).length, 1);
  assert.equal((await expect(daemon, 200, 'GET', '/v1/strands')).json.strands.length, 1);
});

test('heads', async (t) => {
  const daemon = await startDaemon(t);
  const first = await expect(daemon, 201, 'POST', '/v1/heads?name=ball', { body: head_obj() });
  const head = first.json;
  assert.equal(first.headers.get('location'), `/v1/heads/${head.id}`);
  assert.equal(head.format, 'obj');
  assert.equal(head.has_uv, false);
  assert.ok(head.triangles > 100);
  assert.deepEqual((await expect(daemon, 200, 'GET', `/v1/heads/${head.id}`)).json, head);
  await expect(daemon, 304, 'GET', `/v1/heads/${head.id}`, { headers: { 'If-None-Match': first.headers.get('etag') } });
  assert.equal((await expect(daemon, 200, 'GET', `/v1/heads/${head.id}/data`)).text, head_obj());
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/heads')).json.heads, [head]);
  await expect(daemon, 200, 'POST', '/v1/heads', { body: head_obj() });
  await refused(daemon, 415, 'unknown-format', 'POST', '/v1/heads', { body: 'no mesh' });
  await refused(daemon, 400, 'invalid-argument', 'POST', '/v1/heads?format=fbx', { body: head_obj(), problem: { parameter: 'format' } });
  await refused(daemon, 404, 'not-found', 'GET', '/v1/heads/head_nothing');
  await refused(daemon, 404, 'not-found', 'GET', '/v1/heads/head_nothing/data');
  await refused(daemon, 404, 'not-found', 'GET', `/v1/strands/${head.id}`);
});
