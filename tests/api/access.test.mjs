// Who may do what: tokens, scopes, projects, limits, sessions, other origins, repeated requests, the audit.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { build, groomctl, run, startDaemon, temporaryFolder } from '../support/daemon.mjs';
import { call, events, expect, groom_document, hair, head_obj, refused, startIdleDaemon, upload } from '../support/api.mjs';

const groomd = (args, options) => run(join(build, 'groomd'), args, options);

/** Makes a token while the daemon runs: { id, token }. */
async function token(folder, name, ...options) {
  const { status, stdout, stderr } = await groomd(['token', 'create', '--data', folder, '--name', name, '--json', ...options]);
  assert.equal(status, 0, stderr);
  return JSON.parse(stdout);
}
const expiry = (ms) => new Promise((done) => setTimeout(done, ms));

test('an address that others reach needs a token first, and says how to make one', async (t) => {
  const folder = temporaryFolder(t);
  const without = await groomd(['--data', folder, '--listen', '0.0.0.0:0']);
  assert.equal(without.status, 1);
  assert.match(without.stderr, /groomd token create --name NAME --data DIR/);
  const gone = await token(folder, 'gone');
  assert.equal((await groomd(['token', 'revoke', gone.id, '--data', folder])).status, 0);
  assert.equal((await groomd(['--data', folder, '--listen', '0.0.0.0:0'])).status, 1, 'one that is revoked does not count');
  const daemon = await startDaemon(t, { args: ['--listen', '0.0.0.0:0'], prepare: (data) => token(data, 'ann') });
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs');
});

test('groomd token', async (t) => {
  const folder = temporaryFolder(t);
  const command = (...args) => groomd(['token', ...args, '--data', folder]);
  const made = await command('create', '--name', 'ann', '--project', 'film', '--scopes', 'read,admin', '--expires', '90d', '--bytes', '10G');
  assert.match(made.stdout, /^grt_[a-z2-7]{48}\n$/);
  const text = readFileSync(join(folder, 'tokens.json'), 'utf8');
  assert.ok(!text.includes(made.stdout.trim()), 'the token itself is not kept');
  assert.equal(statSync(join(folder, 'tokens.json')).mode & 0o777, 0o600);
  const [one] = (await command('list', '--json')).lines();
  assert.equal(one.scopes, 'read,admin');
  assert.equal(one.project, 'film');
  assert.equal(one.state, 'good');
  assert.ok(Math.abs(Date.parse(one.expires_at) - Date.now() - 90 * 86400e3) < 60e3);
  assert.match((await command('list')).stdout, /tok_.*good +film +ann +read,admin/);
  assert.equal((await command('revoke', one.id)).status, 0);
  assert.equal((await command('revoke', one.id)).status, 1);
  assert.equal((await command('revoke', 'tok_none')).status, 1);
  assert.match((await command('list')).stdout, /revoked/);
  for (const bad of [['create'], ['create', '--name', ''], ['create', '--name', 'a', '--scopes', 'all'], ['create', '--name', 'a', '--project', 'Film/1'],
    ['create', '--name', 'a', '--expires', 'soon'], ['create', '--name', 'a', '--queued', '-1'], ['make'], ['revoke'], ['create', '--nam', 'a']])
    assert.equal((await command(...bad)).status, 2, bad.join(' '));
  assert.match((await command('--help')).stdout, /--scopes/);
  const many = await Promise.all(Array.from({ length: 8 }, (_, i) => token(folder, `t${i}`)));
  assert.equal(new Set(many.map(({ id }) => id)).size, 8);
  assert.equal((await command('list', '--json')).lines().length, 9, 'commands at once lose none');
});

test('tokens are asked for from the first one on, and end at once', async (t) => {
  const daemon = await startDaemon(t);
  assert.equal((await expect(daemon, 200, 'GET', '/v1/session')).json.token_needed, false);
  const strands = await upload(daemon);
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { headers: { 'X-Forwarded-For': '10.0.0.1' }, problem: { detail: /proxy/ } });
  const ann = await token(daemon.data, 'ann'), short = await token(daemon.data, 'short', '--expires', '1s');
  const { headers } = await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs');
  assert.equal(headers.get('www-authenticate'), 'Bearer realm="groomd"');
  const wrong = await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { token: ann.token.slice(0, -1) + (ann.token.endsWith('a') ? 'b' : 'a') });
  assert.match(wrong.headers.get('www-authenticate'), /error="invalid_token"/);
  await refused(daemon, 401, 'unauthorized', 'POST', '/v1/strands', { body: Buffer.alloc(3 << 20) });
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { headers: { Authorization: `Basic ${ann.token}` } });
  await expect(daemon, 200, 'GET', '/v1/jobs', { token: ann.token });
  await expect(daemon, 200, 'GET', '/v1/jobs', { headers: { Authorization: `bearer  ${ann.token}` } });
  assert.equal((await expect(daemon, 200, 'GET', '/v1/strands', { token: ann.token })).json.strands[0].id, strands.id, 'what was there is project default\'s');
  for (const open of ['/healthz', '/readyz', '/openapi.json', '/status.css']) await expect(daemon, 200, 'GET', open);
  assert.doesNotMatch((await expect(daemon, 200, 'GET', '/status')).text, /<h2>Jobs/);
  assert.match((await expect(daemon, 200, 'GET', '/status', { token: ann.token })).text, /<h2>Jobs/);
  await expiry(1500);
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { token: short.token, problem: { detail: /expired/ } });
  await groomd(['token', 'revoke', ann.id, '--data', daemon.data]);
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { token: ann.token, problem: { detail: /revoked/ } });
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs');
});

test('a token does what its scopes say', async (t) => {
  const daemon = await startIdleDaemon(t);
  const [reader, sender, keeper, worker] = await Promise.all(['read', 'submit', 'admin', 'work'].map((scope) => token(daemon.data, scope, '--scopes', scope)));
  const lacks = async (scope, method, path, who, options = {}) => {
    const { headers } = await refused(daemon, 403, 'insufficient-scope', method, path, { ...options, token: who.token, problem: { detail: new RegExp(`scope ${scope}`) } });
    assert.match(headers.get('www-authenticate'), new RegExp(`insufficient_scope.*scope="${scope}"`));
  };
  await expect(daemon, 200, 'GET', '/v1/strands', { token: reader.token });
  await lacks('submit', 'POST', '/v1/strands', reader, { body: hair(4, 4) });
  await lacks('submit', 'DELETE', '/v1/jobs/job_x', reader);
  const { json: strands } = await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(4, 4), token: sender.token });
  await lacks('read', 'GET', `/v1/strands/${strands.id}`, sender);
  for (const path of ['/metrics', '/v1/audit']) {
    await lacks('admin', 'GET', path, reader);
    await lacks('admin', 'GET', path, sender);
    await expect(daemon, 200, 'GET', path, { token: keeper.token });
  }
  await lacks('read', 'GET', '/v1/jobs', keeper);
  await lacks('read', 'GET', '/v1/jobs', worker);
  const job = { kind: 'fit', strands: strands.id };
  await refused(daemon, 403, 'invalid-argument', 'POST', '/v1/jobs', { body: { ...job, priority: 1 }, token: sender.token, problem: { pointer: '/priority', detail: /admin/ } });
  const { json: made } = await expect(daemon, 202, 'POST', '/v1/jobs', { body: { ...job, priority: -1 }, token: sender.token });
  const attempt = await daemon.attempt();
  await expect(daemon, 200, 'GET', '/v1/work/job', { token: attempt });
  for (const who of [reader, sender, keeper, worker]) await refused(daemon, 401, 'unauthorized', 'GET', '/v1/work/job', { token: who.token });
  await refused(daemon, 401, 'unauthorized', 'GET', `/v1/jobs/${made.id}`, { token: attempt });
});

test('another project is not there', async (t) => {
  const daemon = await startIdleDaemon(t);
  const film = { token: (await token(daemon.data, 'film', '--project', 'film')).token };
  const game = { token: (await token(daemon.data, 'game', '--project', 'game')).token };
  const bytes = hair(20, 10);
  const mine = (await expect(daemon, 201, 'POST', '/v1/strands?name=secret', { body: bytes, ...film })).json;
  const same = await expect(daemon, 201, 'POST', '/v1/strands?name=other', { body: bytes, ...game });
  assert.notEqual(same.json.id, mine.id);
  assert.equal(same.json.name, 'other');
  assert.equal(same.json.sha256, mine.sha256);
  await expect(daemon, 200, 'POST', '/v1/strands', { body: bytes, ...film });
  const head = (await expect(daemon, 201, 'POST', '/v1/heads', { body: head_obj(), ...film })).json;
  const job = (await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: mine.id, head: head.id }, ...film })).json;
  const attempt = await daemon.attempt();
  await expect(daemon, 204, 'POST', '/v1/work/result', { token: attempt, body: groom_document() });
  const done = (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`, { ...film, headers: { Prefer: 'wait=30' } })).json;
  const groom = `/v1/grooms/${done.result.groom}`;
  await expect(daemon, 200, 'GET', groom, film);

  const json_patch = { 'Content-Type': 'application/json-patch+json', 'If-Match': '"1"' };
  const calls = [['GET', `/v1/strands/${mine.id}`], ['GET', `/v1/strands/${mine.id}/data`], ['GET', `/v1/heads/${head.id}`], ['GET', `/v1/heads/${head.id}/data`],
    ['GET', `/v1/jobs/${job.id}`], ['DELETE', `/v1/jobs/${job.id}`], ['GET', `/v1/jobs/${job.id}/events`], ['GET', `/v1/jobs/${job.id}/losses`],
    ['GET', groom], ['GET', `${groom}/strands`], ['GET', `${groom}/guides`], ['GET', `${groom}/revisions`], ['GET', `${groom}/preview.png`], ['GET', `${groom}/turntable.png`],
    ['PATCH', groom, { headers: json_patch, body: '[]' }], ['PUT', `${groom}/guides`, { headers: { 'If-Match': '"1"' }, body: hair(4, 12) }],
    ['POST', `${groom}/revert`, { headers: { 'If-Match': '"1"' }, body: { revision: 1 } }]];
  for (const [method, path, options] of calls) {
    const there = await refused(daemon, 404, 'not-found', method, path, { ...options, ...game });
    const id = path.split('/')[3];
    const nowhere = await refused(daemon, 404, 'not-found', method, path.replace(id, id.slice(0, 5) + 'x'.repeat(id.length - 5)), { ...options, ...game });
    const plain = ({ json }, its) => ({ ...json, request: '', instance: '', detail: json.detail.replace(its, 'ID') });
    assert.deepEqual(plain(there, id), plain(nowhere, id.slice(0, 5) + 'x'.repeat(id.length - 5)), `${method} ${path} tells nothing`);
  }
  for (const list of ['jobs', 'heads', 'grooms'])
    assert.deepEqual((await expect(daemon, 200, 'GET', `/v1/${list}`, game)).json[list], [], list);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/strands', game)).json.strands.map(({ id }) => id), [same.json.id]);
  await refused(daemon, 422, 'invalid-argument', 'POST', '/v1/jobs', { body: { kind: 'fit', strands: mine.id }, ...game, problem: { pointer: '/strands' } });
  await refused(daemon, 422, 'invalid-argument', 'POST', '/v1/jobs', { body: { kind: 'fit', strands: same.json.id, head: head.id }, ...game, problem: { pointer: '/head' } });

  await t.test('a document that names another project\'s head is drawn without it', async () => {
    const document = groom_document();
    const picture = async (source, who) => {
      const { json } = await expect(daemon, 201, 'POST', '/v1/grooms', { body: { ...document, source }, ...who });
      return (await expect(daemon, 200, 'GET', `/v1/grooms/${json.groom}/preview.png?size=64`, who)).bytes;
    };
    const bare = await picture({}, game);
    assert.deepEqual(await picture({ head: head.id }, game), bare);
    assert.notDeepEqual(await picture({ head: head.id }, film), bare);
  });
});

test('limits of a token: how often, how much, how many', async (t) => {
  const daemon = await startIdleDaemon(t, { args: ['--max-queue', '3'] });
  const slow = await token(daemon.data, 'slow', '--requests-per-second', '1');
  const statuses = [];
  for (let i = 0; i < 14; i++) statuses.push((await call(daemon, 'GET', '/v1/jobs', { token: slow.token })).status);
  assert.deepEqual(statuses.slice(0, 10), Array(10).fill(200), 'ten seconds\' worth at once');
  assert.ok(statuses.includes(429));
  const { headers } = await refused(daemon, 429, 'too-many-requests', 'GET', '/v1/jobs', { token: slow.token, problem: { detail: /1 times a second/ } });
  assert.match(headers.get('retry-after'), /^[12]$/);
  await expect(daemon, 200, 'GET', '/healthz', { token: slow.token });

  const small = await token(daemon.data, 'small', '--bytes', '2K', '--queued', '1');
  const { json: strands } = await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(10, 10), token: small.token });
  const full = await refused(daemon, 429, 'limit-reached', 'POST', '/v1/strands', { body: hair(11, 10), token: small.token, problem: { detail: /limit is 2048/ } });
  assert.ok(Number(full.headers.get('retry-after')) > 60);
  await expect(daemon, 200, 'POST', '/v1/strands', { body: hair(10, 10), token: small.token });
  const submit = (who, status = 202) => expect(daemon, status, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: strands.id }, token: who.token });
  await submit(small); // runs
  await daemon.attempt();
  await submit(small);
  const waits = await submit(small, 429);
  assert.match(waits.json.detail, /of this token wait/);
  assert.equal(waits.headers.get('retry-after'), '30');
  const me = (await expect(daemon, 200, 'GET', '/v1/session', { token: small.token })).json;
  assert.deepEqual(me.limits, { requests_per_s: null, bytes: 2048, queued: 1 });
  assert.deepEqual(me.used, { bytes: hair(10, 10).length, queued: 1 });
  const other = await token(daemon.data, 'other');
  await submit(other);
  await submit(other);
  assert.match((await submit(other, 429)).json.detail, /queue is full/);
});

test('a browser\'s session looks and changes nothing', async (t) => {
  const daemon = await startIdleDaemon(t, { args: ['--session-time', '60'] });
  const ann = await token(daemon.data, 'ann');
  await refused(daemon, 401, 'unauthorized', 'POST', '/v1/session');
  const made = await expect(daemon, 201, 'POST', '/v1/session', { token: ann.token });
  const cookie = made.headers.get('set-cookie');
  assert.match(cookie, /^groomd_session=[^;]+; Path=\/; Max-Age=60; HttpOnly; SameSite=Strict$/);
  assert.ok(!cookie.includes(ann.token));
  assert.match((await expect(daemon, 201, 'POST', '/v1/session', { token: ann.token, headers: { 'X-Forwarded-Proto': 'https' } })).headers.get('set-cookie'), /; Secure$/);
  const Cookie = `theme=dark; ${cookie.split(';')[0]}`;
  const strands = (await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(4, 4), token: ann.token })).json;
  const job = (await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: strands.id }, token: ann.token })).json;
  await expect(daemon, 200, 'GET', `/v1/strands/${strands.id}/data`, { headers: { Cookie } });
  const seen = await events(daemon, `/v1/jobs/${job.id}/events`, { headers: { Cookie }, stop: (found) => found.length > 0 });
  assert.equal(seen[0].event, 'state');
  await refused(daemon, 401, 'unauthorized', 'DELETE', `/v1/jobs/${job.id}`, { headers: { Cookie } });
  await refused(daemon, 401, 'unauthorized', 'POST', '/v1/session', { headers: { Cookie } });
  const forged = Cookie.replace(/\.(\d+)\./, (_, end) => `.${Number(end) + 1000}.`);
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { headers: { Cookie: forged } });
  for (const bad of ['', 'x', '..', `${ann.id}.99999999999.${'0'.repeat(64)}`, 'a'.repeat(300)])
    await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { headers: { Cookie: `groomd_session=${bad}` } });
  assert.match((await expect(daemon, 204, 'DELETE', '/v1/session')).headers.get('set-cookie'), /groomd_session=; .*Max-Age=0/);
  await groomd(['token', 'revoke', ann.id, '--data', daemon.data]);
  await refused(daemon, 401, 'unauthorized', 'GET', '/v1/jobs', { headers: { Cookie } });
});

test('pages of other origins, where they are allowed', async (t) => {
  const daemon = await startDaemon(t, { args: ['--cors-origins', 'https://studio.example http://localhost:3000'] });
  const ask = (origin, extra = {}) => daemon.fetch('/v1/strands', { method: 'OPTIONS', headers: { Origin: origin, 'Access-Control-Request-Method': 'POST', 'Access-Control-Request-Headers': 'authorization', ...extra } });
  const allowed = await ask('https://studio.example');
  assert.equal(allowed.status, 204);
  assert.equal(allowed.headers.get('access-control-allow-origin'), 'https://studio.example');
  assert.match(allowed.headers.get('access-control-allow-methods'), /POST/);
  assert.match(allowed.headers.get('access-control-allow-headers'), /Authorization.*If-Match/);
  assert.equal(allowed.headers.get('access-control-allow-credentials'), null, 'no cookies');
  assert.equal((await ask('https://evil.example')).status, 403);
  assert.equal((await ask('https://studio.example.evil')).status, 403);
  assert.equal((await ask('null')).status, 403);
  const { headers } = await expect(daemon, 200, 'GET', '/v1/jobs', { headers: { Origin: 'http://localhost:3000' } });
  assert.equal(headers.get('access-control-allow-origin'), 'http://localhost:3000');
  assert.equal(headers.get('vary'), 'Origin');
  assert.match(headers.get('access-control-expose-headers'), /ETag/);
  assert.equal((await expect(daemon, 200, 'GET', '/v1/jobs', { headers: { Origin: 'https://evil.example' } })).headers.get('access-control-allow-origin'), null);
  await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(4, 4), headers: { Origin: 'https://studio.example' } });
  await refused(daemon, 403, 'cross-origin', 'POST', '/v1/strands', { body: hair(4, 4), headers: { Origin: 'https://evil.example' } });
});

test('a request with a key is done once, also over a restart and at the same moment', async (t) => {
  const daemon = await startDaemon(t, { args: ['--keep-keys', '3'] });
  const document = groom_document();
  const post = (key, body = document) => call(daemon, 'POST', '/v1/grooms', { headers: { 'Idempotency-Key': key }, body });
  const both = await Promise.all([post('k'), post('k'), post('k')]);
  assert.deepEqual(both.map(({ status }) => status), [201, 201, 201]);
  assert.equal(new Set(both.map(({ json }) => json.groom)).size, 1);
  assert.equal(both.filter(({ headers }) => headers.get('idempotent-replayed')).length, 2);
  assert.equal((await post('k', { ...document, name: 'b' })).json.type, '/problems/idempotency-key-reused');
  const groom = `/v1/grooms/${both[0].json.groom}`;
  const edit = (key, name = 'b') => call(daemon, 'PATCH', groom, { headers: { 'Idempotency-Key': key, 'Content-Type': 'application/merge-patch+json', 'If-Match': '"1"' }, body: { name } });
  const edits = await Promise.all([edit('e'), edit('e'), edit('e')]);
  for (const { status, json, headers } of edits) {
    assert.equal(status, 201, JSON.stringify(json));
    assert.equal(json.revision, 2);
    assert.equal(headers.get('etag'), '"2"');
  }
  assert.equal((await edit('e', 'c')).status, 422);
  assert.equal((await edit('f', 'c')).status, 412);
  await refused(daemon, 400, 'invalid-argument', 'POST', '/v1/grooms', { headers: { 'Idempotency-Key': 'k'.repeat(256) }, body: document });
  await daemon.kill();
  await daemon.start();
  const again = await edit('e');
  assert.equal(again.status, 201);
  assert.equal(again.json.revision, 2);
  await expiry(3200);
  assert.equal((await edit('e')).status, 412, 'it is forgotten, and the edit comes too late');
  assert.equal((await expect(daemon, 200, 'GET', `${groom}/revisions`)).json.revisions.length, 2);
});

test('the audit tells who changed what, and no secrets', async (t) => {
  const daemon = await startIdleDaemon(t);
  const ann = await token(daemon.data, 'ann', '--project', 'film', '--scopes', 'read,submit,admin');
  const who = { token: ann.token };
  const { json: strands, headers } = await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(4, 4), ...who });
  const { json: job } = await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: strands.id }, ...who });
  const attempt = await daemon.attempt();
  await expect(daemon, 204, 'POST', '/v1/work/result', { token: attempt, body: groom_document() });
  await groomd(['token', 'revoke', (await token(daemon.data, 'bob')).id, '--data', daemon.data]);
  await refused(daemon, 404, 'not-found', 'DELETE', '/v1/jobs/job_none', who);
  const { json: { audit }, text } = await expect(daemon, 200, 'GET', '/v1/audit', who);
  assert.deepEqual(audit.map(({ action }) => action), ['token.revoke', 'token.create', 'job.end', 'groom.create', 'job.create', 'strands.upload', 'token.create']);
  const upload_row = audit[5];
  assert.deepEqual([upload_row.subject, upload_row.project, upload_row.request, upload_row.who], [strands.id, 'film', headers.get('x-request-id'), { name: 'ann', token: ann.id }]);
  assert.deepEqual(audit[2].who, { name: 'attempt', token: `${job.id}.1` });
  assert.equal(audit[2].detail, 'succeeded');
  assert.ok(!text.includes(ann.token) && !text.includes(attempt));
  const page = (await expect(daemon, 200, 'GET', '/v1/audit?limit=3', who)).json;
  assert.equal((await expect(daemon, 200, 'GET', `/v1/audit?limit=3&before=${page.next}`, who)).json.audit[0].action, 'groom.create');
  assert.ok(!daemon.log().includes(ann.token) && !daemon.log().includes(attempt), 'no token is in the log');
  const line = daemon.log().split('\n').find((entry) => entry.includes(headers.get('x-request-id')));
  assert.equal(JSON.parse(line).token, ann.id);
});

test('groomctl shows its token, from an option, the environment or a file', async (t) => {
  const daemon = await startDaemon(t);
  const { token: text } = await token(daemon.data, 'ann');
  const folder = temporaryFolder(t), home = { HOME: folder, GROOM_TOKEN: '', GROOMD_TOKEN: '', XDG_CONFIG_HOME: '' };
  const list = (env, ...args) => groomctl(daemon, ['list', 'jobs', ...args], { env: { ...home, ...env } });
  const without = await list({});
  assert.equal(without.status, 1);
  assert.match(without.stderr, /GROOMD_TOKEN/);
  assert.equal((await list({ GROOMD_TOKEN: text })).status, 0);
  assert.equal((await list({}, '--token', text)).status, 0);
  const { writeFileSync, mkdirSync } = await import('node:fs');
  writeFileSync(join(folder, 'secret'), `${text}\n`);
  assert.equal((await list({}, '--token-file', join(folder, 'secret'))).status, 0);
  assert.equal((await list({}, '--token-file', join(folder, 'nothing'))).status, 2);
  mkdirSync(join(folder, '.config/groom'), { recursive: true });
  writeFileSync(join(folder, '.config/groom/token'), text);
  assert.equal((await list({})).status, 0);
});
