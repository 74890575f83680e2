// Every operation of proto/openapi.yaml with arguments made from its description and bent: whatever is
// sent, the answer is one that the description has, and never the service's own fault. Then bytes that no
// description knows: two readings of one request, bodies that grow, JSON without an end.
//   FUZZ_CALLS (400), FUZZ_SEED (1)
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { crc32, deflateRawSync, gzipSync } from 'node:zlib';

import { call, expect, groom_document, hair, head_obj, raw, refused, startIdleDaemon, submit, upload } from '../support/api.mjs';
import { slowness, startDaemon } from '../support/daemon.mjs';
import { random } from '../support/kills.mjs';
import { document, operations } from '../support/openapi.mjs';

const n_calls = Number(process.env.FUZZ_CALLS ?? 400), seed = Number(process.env.FUZZ_SEED ?? 1);
const resolved = (node) => (node?.$ref ? node.$ref.slice(2).split('/').reduce((at, key) => at[key], document) : node);

// --- values from schemas ----------------------------------------------------------------------

const wild = [null, true, -1, 0, 1, 2147483648, 1e308, -1e-320, 0.5, '', 'x', '\u0000', '\ud83d\ude00'.repeat(3), '../../etc/passwd', '%00', 'a'.repeat(2000), [], {}, [[[[]]]], { a: { b: [1, 2, { c: null }] } }];
const one_of = (next, items) => items[Math.floor(next() * items.length)];

function value_of(schema, next, depth = 0) {
  schema = resolved(schema) ?? {};
  if (next() < 0.08 || depth > 6) return one_of(next, wild);
  if (schema.const !== undefined) return schema.const;
  if (schema.enum) return one_of(next, schema.enum);
  const choice = schema.oneOf ?? schema.anyOf;
  if (choice) return value_of(one_of(next, choice), next, depth + 1);
  if (schema.default !== undefined && next() < 0.3) return schema.default;
  const type = Array.isArray(schema.type) ? one_of(next, schema.type) : schema.type;
  const low = schema.minimum ?? -10, high = schema.maximum ?? low + 100;
  switch (type) {
    case 'integer': return one_of(next, [low, high, low - 1, high + 1, Math.floor(low + next() * (high - low)), 3]);
    case 'number': return one_of(next, [low, high, low - 0.001, high * 1.001 + 1, low + next() * (high - low)]);
    case 'boolean': return next() < 0.5;
    case 'null': return null;
    case 'string': return one_of(next, ['', 'x', 'a'.repeat(Math.min(schema.maxLength ?? 40, 4000)), 'a'.repeat(Math.min((schema.maxLength ?? 40) + 1, 4000)), 'm', 'y', 'AAAA', '2', '0'.repeat(64)]);
    case 'array': return Array.from({ length: Math.floor(next() * 4) }, () => value_of(schema.items, next, depth + 1));
    default: {
      const object = {};
      for (const [name, property] of Object.entries(schema.properties ?? {}))
        if (next() < (schema.required?.includes(name) ? 0.95 : 0.4)) object[name] = value_of(property, next, depth + 1);
      if (next() < 0.1) object[one_of(next, ['', 'x', '__proto__', 'id', 'strands'])] = one_of(next, wild);
      return object;
    }
  }
}

/** Bytes for a body that the description calls binary, or that is to be no JSON at all. */
function bytes_of(next) {
  const good = one_of(next, [hair(3, 4), Buffer.from(head_obj()), Buffer.from(JSON.stringify(groom_document({ n: 6, m: 4 }))), Buffer.from('{"strands":[[[0,0,0],[0,1,0]]]}')]);
  const bytes = Buffer.from(good.subarray(0, next() < 0.5 ? good.length : Math.floor(next() * good.length)));
  for (let i = Math.floor(next() * 6); i > 0 && bytes.length; i--) bytes[Math.floor(next() * bytes.length)] = Math.floor(next() * 256);
  return bytes;
}

function body_of(method, operation, next, ids) {
  const content = resolved(operation.requestBody)?.content;
  if (!content) return method !== 'GET' && next() < 0.05 ? { body: 'surplus', type: 'text/plain' } : {};
  const type = one_of(next, Object.keys(content)), { schema } = content[type];
  if (next() < 0.1) return { body: bytes_of(next), type: one_of(next, [type, 'application/json', 'application/octet-stream', 'multipart/form-data', '']) };
  if (!/json/.test(type)) return { body: bytes_of(next), type };
  if (next() < 0.05) return { body: `${'[{"a":'.repeat(1000)}1`, type };
  const value = value_of(schema, next);
  if (value && typeof value === 'object' && !Array.isArray(value)) // ids that exist, so that more than the first check is reached
    for (const name of ['strands', 'head']) if (name in value && next() < 0.7) value[name] = ids[name];
  return { body: JSON.stringify(value) ?? 'undefined', type };
}

const bad_ids = ['x', '..', '%2e%2e', '%00', '%ff', 'str_', `str_${'a'.repeat(20)}`, 'a'.repeat(3000), '%F0%9F%98%80', "'--", '"', '%25s%25n'];
const kind_of = (path) => (/strands/.test(path.split('/')[2]) ? 'strands' : { heads: 'head', grooms: 'groom', jobs: 'job', uploads: 'upload' }[path.split('/')[2]]);

function request_of({ method, path, operation }, next, ids) {
  const parameters = [...(document.paths[path].parameters ?? []), ...(operation.parameters ?? [])].map(resolved);
  const headers = {}, query = [];
  const target = path.replace(/\{([^}]+)\}/g, () => (next() < 0.75 && ids[kind_of(path)] ? ids[kind_of(path)] : one_of(next, bad_ids)));
  for (const parameter of parameters) {
    const value = parameter.name === 'If-Match' ? one_of(next, ['"1"', '"2"', '"99"', '1', '*', '""', 'W/"1"']) : value_of(parameter.schema, next);
    const text = typeof value === 'object' ? JSON.stringify(value) : String(value);
    if (parameter.in === 'query' && next() < 0.4) query.push(`${encodeURIComponent(parameter.name)}=${encodeURIComponent(text)}`);
    if (parameter.in === 'header' && (parameter.required || next() < 0.4)) headers[parameter.name] = text.replace(/[^\x20-\x7e]/g, '?').trim();
  }
  if (next() < 0.05) query.push(one_of(next, ['x=1', '%zz=1', 'limit=1&limit=2', '=', '&&&', 'a'.repeat(500)]));
  if (next() < 0.1) headers.Range = one_of(next, ['bytes=0-1', 'bytes=5-1', 'bytes=-0', 'bytes=99999999999-', 'x', 'bytes=0-1,3-4']);
  if (next() < 0.1) headers['If-None-Match'] = one_of(next, ['*', '"1"', 'x']);
  const { body, type } = body_of(method, operation, next, ids);
  if (body !== undefined && type) headers['Content-Type'] = type;
  return { method, target: target + (query.length ? `?${query.join('&')}` : ''), options: { headers, body: typeof body === 'string' ? Buffer.from(body) : body, token: /^\/v1\/work/.test(path) && next() < 0.7 ? ids.token : undefined } };
}

// --- the calls -----------------------------------------------------------------------------------

async function fresh(daemon) {
  const strands = await upload(daemon, 5, 6);
  const head = (await call(daemon, 'POST', '/v1/heads', { body: head_obj() })).json;
  const groom = (await call(daemon, 'POST', '/v1/grooms', { body: groom_document({ n: 12, m: 6 }) })).json;
  const job = (await call(daemon, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: strands.id } })).json;
  return { strands: strands.id, head: head.id, groom: groom.groom ?? groom.id, job: job.id };
}

test(`${n_calls} bent calls of every operation are answered as described`, { timeout: (60000 + n_calls * 500) * slowness }, async (t) => {
  const daemon = await startIdleDaemon(t, { args: ['--parse-time', '20'] }), next = random(seed), statuses = new Map();
  const token = (await submit(daemon), await daemon.attempt());
  let ids;
  for (let i = 0; i < n_calls; i++) {
    if (i % 100 === 0) ids = { ...(await fresh(daemon)), token };
    const described = operations[i % operations.length], { method, target, options } = request_of(described, next, ids);
    const what = `call ${i} of seed ${seed}: ${method} ${target.slice(0, 200)} ${JSON.stringify(options.headers).slice(0, 300)} ${String(options.body ?? '').slice(0, 300)}`;
    let answer;
    try {
      answer = await call(daemon, method, target, { ...options, signal: AbortSignal.timeout(/events|jobs\//.test(described.path) ? 1000 : 30000 * slowness) });
    } catch (error) {
      if (error.name === 'TimeoutError' && /jobs/.test(described.path)) continue; // it waits for its job, as it should
      throw new Error(`${what}\n${error.stack}\n${error.cause?.stack ?? ''}`);
    }
    assert.ok(answer.status < 500, `${what}: ${answer.status} ${answer.text.slice(0, 500)}`);
    if (answer.json?.id && method === 'POST' && described.path === '/v1/uploads') ids.upload = answer.json.id;
    const location = answer.headers.get('location');
    if (described.path === '/v1/uploads' && location) ids.upload = location.split('/').at(-1);
    statuses.set(answer.status, (statuses.get(answer.status) ?? 0) + 1);
  }
  await expect(daemon, 200, 'GET', '/readyz');
  t.diagnostic([...statuses].sort(([a], [b]) => a - b).map(([status, n]) => `${status}: ${n}`).join(', '));
  assert.ok([...statuses.keys()].some((status) => status < 300) && [...statuses.keys()].some((status) => status >= 400));
});

// --- bytes ----------------------------------------------------------------------------------------------

test('two readings of one request: never is the second one answered', { timeout: 60000 * slowness }, async (t) => {
  const daemon = await startDaemon(t), inner = 'GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-Inner: 1\r\n\r\n';
  const post = (headers, body) => `POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n${headers}\r\n${body}`;
  const cases = {
    'two lengths': post('Content-Length: 2\r\nContent-Length: 60\r\n', `{}${inner}`),
    'two equal lengths': post('Content-Length: 2\r\nContent-Length: 2\r\n', `{}${inner}`),
    'a list of lengths': post('Content-Length: 2, 60\r\n', `{}${inner}`),
    'a signed length': post('Content-Length: +2\r\n', `{}${inner}`),
    'a length in hexadecimal': post('Content-Length: 0x2\r\n', `{}${inner}`),
    'a length with a blank inside': post('Content-Length: 2 0\r\n', `{}${inner}`),
    'length and chunks': post('Content-Length: 60\r\nTransfer-Encoding: chunked\r\n', `0\r\n\r\n${inner}`),
    'chunks and length': post('Transfer-Encoding: chunked\r\nContent-Length: 5\r\n', `0\r\n\r\n${inner}`),
    'two codings': post('Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n', `0\r\n\r\n${inner}`),
    'a list of codings': post('Transfer-Encoding: identity, chunked\r\n', `0\r\n\r\n${inner}`),
    'an unknown coding': post('Transfer-Encoding: xchunked\r\n', `0\r\n\r\n${inner}`),
    'a coding with a tab': post('Transfer-Encoding:\tchunked\x0b\r\n', `0\r\n\r\n${inner}`),
    'a blank before the colon': post('Content-Length : 60\r\n', `{}${inner}`),
    'a folded coding': post('Transfer-Encoding:\r\n chunked\r\nContent-Length: 5\r\n', `0\r\n\r\n${inner}`),
    'a folded length': post('Content-Length: 2\r\n 0\r\n', `{}${inner}`),
    'a chunk size with a sign': post('Transfer-Encoding: chunked\r\n', `-1\r\n{}\r\n0\r\n\r\n${inner}`),
    'a chunk size that overflows': post('Transfer-Encoding: chunked\r\n', `10000000000000002\r\n{}\r\n0\r\n\r\n${inner}`),
    'a chunk longer than it says': post('Transfer-Encoding: chunked\r\n', `1\r\n{}\r\n0\r\n\r\n${inner}`),
    'two hosts': `GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n${inner}`,
    'a null byte in a header': post('X: a\0b\r\nContent-Length: 60\r\n', `{}${inner}`),
  };
  for (const [what, bytes] of Object.entries(cases)) {
    const answer = await raw(daemon, bytes, 1500);
    const n_ok = (answer.match(/HTTP\/1\.1 200/g) ?? []).length;
    assert.equal(n_ok, 0, `${what}: ${answer.slice(0, 600)}`);
    if (answer) assert.match(answer, /^HTTP\/1\.[01] (4\d\d|501)/, what);
  }
  // and what is well formed goes on
  const good = await raw(daemon, post('Transfer-Encoding: chunked\r\n', `2\r\n{}\r\n0\r\n\r\n${inner.replace('X-Inner: 1', 'Connection: close')}`), 3000);
  assert.match(good, /^HTTP\/1\.1 400 [^]*HTTP\/1\.1 200 /);
});

/** A zip with one deflated entry, as .npz is. */
function zip(name, compressed, size, crc = 0) {
  const local = Buffer.alloc(30), central = Buffer.alloc(46), end = Buffer.alloc(22), title = Buffer.from(name);
  const fields = (buffer, at) => { buffer.writeUInt16LE(8, at); buffer.writeUInt32LE(crc, at + 6); buffer.writeUInt32LE(compressed.length, at + 10); buffer.writeUInt32LE(size >>> 0, at + 14); buffer.writeUInt16LE(title.length, at + 18); };
  local.writeUInt32LE(0x04034b50, 0); local.writeUInt16LE(20, 4); fields(local, 8);
  central.writeUInt32LE(0x02014b50, 0); central.writeUInt16LE(20, 4); central.writeUInt16LE(20, 6); fields(central, 10);
  const at = 30 + title.length + compressed.length;
  end.writeUInt32LE(0x06054b50, 0); end.writeUInt16LE(1, 8); end.writeUInt16LE(1, 10); end.writeUInt32LE(46 + title.length, 12); end.writeUInt32LE(at, 16);
  return Buffer.concat([local, title, compressed, central, title, end]);
}

const npy = (shape) => {
  const header = `{'descr': '<f4', 'fortran_order': False, 'shape': (${shape.join(', ')}), }`;
  const text = header.padEnd(Math.ceil((11 + header.length) / 64) * 64 - 11) + '\n', head = Buffer.from('\x93NUMPY\x01\x00\0\0', 'latin1');
  head.writeUInt16LE(text.length, 8);
  return Buffer.concat([head, Buffer.from(text)]);
};

test('bodies that grow are refused, and cost little', { timeout: 120000 * slowness }, async (t) => {
  const daemon = await startDaemon(t, { args: ['--parse-memory', slowness > 1 ? '16G' : '512M', '--parse-time', '20'] });
  const plain = Buffer.concat([npy([25000, 400, 3]), Buffer.alloc(120000000)]);
  const bomb = zip('strands.npy', deflateRawSync(plain), plain.length, crc32 ? crc32(plain) : 0);
  t.diagnostic(`${bomb.length} bytes that become ${plain.length}`);
  const answers = {
    'zeros, a thousandfold': await call(daemon, 'POST', '/v1/strands', { body: bomb }),
    'a shape that no machine holds': await call(daemon, 'POST', '/v1/strands', { body: zip('x.npy', deflateRawSync(npy([4000000000, 4000000000, 3])), 128) }),
    'a length that is not true': await call(daemon, 'POST', '/v1/strands', { body: zip('x.npy', deflateRawSync(plain.subarray(0, 20000000)), 4294967295) }),
    'an npy without its numbers': await call(daemon, 'POST', '/v1/strands', { body: npy([1000000000, 100, 3]) }),
  };
  for (const [what, { status, text }] of Object.entries(answers)) assert.ok(status >= 400 && status < 500, `${what}: ${status} ${text}`);
  await refused(daemon, 415, 'unsupported-media-type', 'POST', '/v1/strands', { body: gzipSync(Buffer.alloc(10000000)), headers: { 'Content-Encoding': 'gzip' } });
  await refused(daemon, 415, 'unsupported-media-type', 'POST', '/v1/jobs', { body: gzipSync('{}'), headers: { 'Content-Encoding': 'gzip', 'Content-Type': 'application/json' } });
  await expect(daemon, 200, 'GET', '/readyz');
});

test('JSON 1 000 deep is refused wherever JSON is taken', { timeout: 60000 * slowness }, async (t) => {
  const daemon = await startIdleDaemon(t), token = (await submit(daemon), await daemon.attempt());
  const ids = await fresh(daemon);
  const deep = [`${'['.repeat(1000)}${']'.repeat(1000)}`, `${'{"a":'.repeat(1000)}1${'}'.repeat(1000)}`, '['.repeat(100000)];
  for (const { method, path, operation } of operations) {
    const content = resolved(operation.requestBody)?.content ?? {};
    for (const type of Object.keys(content).filter((name) => /json/.test(name)))
      for (const body of deep) {
        const target = path.replace('{id}', ids[kind_of(path)] ?? 'x');
        const answer = await call(daemon, method, target, { body, token: /work/.test(path) ? token : undefined, headers: { 'Content-Type': type, 'If-Match': '"1"' } });
        assert.ok(answer.status >= 400 && answer.status < 500, `${method} ${target}: ${answer.status} ${answer.text.slice(0, 300)}`);
      }
  }
  await expect(daemon, 200, 'GET', '/readyz');
});
