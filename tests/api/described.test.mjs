// Every operation that proto/openapi.yaml describes is called once in one sitting, and answers as
// described; every route that groomd has is described.
import test from 'node:test';
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { events, expect, groom_document, hair, head_obj, startIdleDaemon, submit, upload, strands_json } from '../support/api.mjs';
import { operations, seen, resolved } from '../support/openapi.mjs';

const here = dirname(fileURLToPath(import.meta.url));

test('proto/openapi.json is made from proto/openapi.yaml', () => {
  execFileSync(process.execPath, [join(here, '../support/openapi.mjs'), '--check']);
});

test('the table of routes and the description name the same calls', () => {
  const text = readFileSync(join(here, '../../server/http/routes.c'), 'utf8');
  const routes = [...text.matchAll(/^ {4}\{"([A-Z]+)", "([^"]+)".*?LANE_[A-Z]+, "([^"]*)"/gm)].map(([, method, path, query]) => ({ method, path, query }));
  assert.deepEqual(routes.map(({ method, path }) => `${method} ${path}`).sort(), operations.map(({ method, path }) => `${method} ${path}`).sort());
  for (const { method, path, query } of routes) {
    const { operation } = operations.find((entry) => entry.method === method && entry.path === path);
    const described = (operation.parameters ?? []).map(resolved).filter((parameter) => parameter.in === 'query').map(({ name }) => name);
    assert.deepEqual(query.split(' ').filter(Boolean).sort(), described.sort(), `query of ${method} ${path}`);
  }
});

test('every operation answers as it is described', async (t) => {
  const daemon = await startIdleDaemon(t);
  const get = (path, status = 200, options) => expect(daemon, status, 'GET', path, options);
  for (const path of ['/', '/studio/studio.js', '/status', '/status.css', '/healthz', '/readyz', '/metrics', '/openapi.json', '/v1/options', '/v1/session', '/v1/audit', '/v1/strands', '/v1/heads', '/v1/jobs', '/v1/grooms'])
    await get(path);

  await expect(daemon, 201, 'POST', '/v1/session');
  await expect(daemon, 204, 'DELETE', '/v1/session');

  const strands = await upload(daemon);
  const head = (await expect(daemon, 201, 'POST', '/v1/heads', { body: head_obj() })).json;
  for (const [kind, { id }] of [['strands', strands], ['heads', head]]) {
    await get(`/v1/${kind}/${id}`);
    await get(`/v1/${kind}/${id}/data`);
  }

  await expect(daemon, 422, 'POST', `/v1/heads/${head.id}/hairline`, { body: { strands: strands.id, source: { head: head.id } } }); // no hair on it

  const tus = { 'Tus-Resumable': '1.0.0' }, bytes = hair(3, 4);
  await expect(daemon, 204, 'OPTIONS', '/v1/uploads');
  const created = await expect(daemon, 201, 'POST', '/v1/uploads', { headers: { ...tus, 'Upload-Length': `${bytes.length}` } });
  const sending = created.headers.get('location');
  await expect(daemon, 204, 'PATCH', sending, { headers: { ...tus, 'Upload-Offset': '0', 'Content-Type': 'application/offset+octet-stream' }, body: bytes });
  await get(sending);
  await expect(daemon, 201, 'POST', `/v1/strands?upload=${sending.split('/').pop()}`);
  await expect(daemon, 204, 'DELETE', sending);

  const job = await submit(daemon, { head: head.id });
  const token = await daemon.attempt();
  const work = (status, method, path, options) => expect(daemon, status, method, `/v1/work/${path}`, { token, ...options });
  const order = (await work(200, 'GET', 'job')).json;
  await work(200, 'GET', `blobs/${order.inputs.head.sha256}`);
  await work(200, 'POST', 'progress', { body: { stage: { name: 'initialize', index: 0, count: 5 }, progress: 0.1, losses: [{ iteration: 0, name: 'total', value: 1 }] } });
  await work(204, 'PUT', 'checkpoint?stage=1', { body: 'state' });
  await work(204, 'POST', 'result', { body: groom_document() });
  const done = (await get(`/v1/jobs/${job.id}`, 200, { headers: { Prefer: 'wait=30' } })).json;
  assert.ok((await events(daemon, `/v1/jobs/${job.id}/events`)).length > 3);
  await get(`/v1/jobs/${job.id}/events?after=100000`, 204);
  await get(`/v1/jobs/${job.id}/losses`);
  await get(`/v1/jobs/${job.id}/deliveries`);
  const failing = await submit(daemon);
  const second = await daemon.attempt();
  await expect(daemon, 204, 'POST', '/v1/work/ended', { token: second, body: { words: 'going' } });
  await expect(daemon, 204, 'POST', '/v1/work/failed', { token: second, body: { type: '/problems/empty', title: 'nothing', status: 422, detail: 'no strand is left' } });
  await expect(daemon, 200, 'DELETE', `/v1/jobs/${failing.id}`);

  const groom = `/v1/grooms/${done.result.groom}`;
  await get(groom);
  await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() });
  await expect(daemon, 201, 'PATCH', groom, { headers: { 'Content-Type': 'application/merge-patch+json', 'If-Match': '"1"' }, body: { name: 'other' } });
  const guides = (await get(`${groom}/guides?format=json`)).json;
  await expect(daemon, 201, 'PUT', `${groom}/guides`, { headers: { 'If-Match': '"2"' }, body: strands_json(guides.strands) });
  await get(`${groom}/strands`);
  await get(`${groom}/revisions`);
  await expect(daemon, 201, 'POST', `${groom}/revert`, { headers: { 'If-Match': '"3"' }, body: { revision: 1 } });
  await get(`${groom}/preview.png?size=64`);
  await get(`${groom}/turntable.png?size=64&frames=2`);
  await get('/docs/');
  await get('/docs/tutorial.html');
  await get(`${groom}/quality`);
  await get(`${groom}/quality.png?size=64&of=target`);
  await get(`/v1/strands/${strands.id}/quality?with=${done.result.groom}`);
  await get(`/grooms/${done.result.groom}/quality`);
  for (const at of [groom, `/v1/strands/${strands.id}`]) {
    await get(`${at}/analysis`);
    await get(`${at}/clusters?count=3`);
    for (const [kind, body] of Object.entries({ ruffle: {}, sculpt: { anchors: [{ strand: 0, at: 1, position: [0, 1.6, 0] }] },
      interpolate: { groom: done.result.groom }, 'curl-scale': { radius: 1.2 } }))
      await expect(daemon, 201, 'POST', `${at}/${kind}`, { body });
  }

  const many = (await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(5001, 3) })).json;
  const edit = (await expect(daemon, 202, 'POST', `/v1/strands/${many.id}/ruffle`, { body: {} })).json;
  const third = await daemon.attempt();
  await expect(daemon, 200, 'GET', '/v1/work/layer', { token: third });
  await expect(daemon, 200, 'GET', '/v1/work/strands', { token: third });
  await expect(daemon, 202, 'DELETE', `/v1/jobs/${edit.id}`);

  const carry = (await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'retarget', groom: done.result.groom, dense: true,
    source: { head: head.id }, target: { head: head.id } } })).json;
  const fourth = await daemon.attempt();
  await expect(daemon, 200, 'GET', '/v1/work/groom', { token: fourth });
  await expect(daemon, 200, 'GET', '/v1/work/strands', { token: fourth });
  await expect(daemon, 204, 'PUT', '/v1/work/preparation', { token: fourth, body: 'of the source alone' });
  await expect(daemon, 202, 'DELETE', `/v1/jobs/${carry.id}`);
  await get(`/v1/jobs/${carry.id}`, 200, { headers: { Prefer: 'wait=10' } }); // it needs the head until its worker is gone

  const other = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom;
  for (const path of [`grooms/${other}`, `strands/${strands.id}`, `heads/${head.id}`]) await expect(daemon, 204, 'DELETE', `/v1/${path}`);

  const missing = operations.map(({ operation }) => operation.operationId).filter((id) => !seen.has(id));
  assert.deepEqual(missing, [], 'operations that no call exercised');
});
