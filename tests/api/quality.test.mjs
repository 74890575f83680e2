// Quality reports: made when asked for, kept, shown as a page; what a fit brings along.
import test from 'node:test';
import assert from 'node:assert/strict';
import { startDaemon } from '../support/daemon.mjs';
import { expect, groom_document, hair, head_obj, points, refused, startIdleDaemon, submit } from '../support/api.mjs';

const upload = async (daemon, fill) => (await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(fill.length, fill[0].length, fill) })).json.id;
const moved = (by) => points(40, 20).map((strand) => strand.map(([x, y, z]) => [x, y, z + by].map(Math.fround)));

test('two uploads are compared', async (t) => {
  const daemon = await startDaemon(t);
  const a = await upload(daemon, moved(0)), b = await upload(daemon, moved(0.0015));
  const same = (await expect(daemon, 200, 'GET', `/v1/strands/${a}/quality?with=${a}`)).json;
  assert.equal(same.fitted.scores[0].f_score, 1);
  assert.equal(same.drawn, null);
  const { json } = await expect(daemon, 200, 'GET', `/v1/strands/${b}/quality?with=${a}`);
  assert.deepEqual([json.id, json.revision, json.target, json.target_revision], [b, null, a, null]);
  assert.ok(Math.abs(json.fitted.nearest.to_target.mean - 0.0015) < 1e-4);
  assert.equal(json.fitted.scores[0].f_score, 0);
  assert.equal(json.fitted.scores[2].f_score, 1);
  assert.ok(Math.abs(json.fitted.paired.distance - 0.0015) < 1e-5);

  await refused(daemon, 400, 'invalid-argument', 'GET', `/v1/strands/${a}/quality`, { problem: { parameter: 'with' } });
  await refused(daemon, 404, 'not-found', 'GET', `/v1/strands/${a}/quality?with=str_nothing`);
  await refused(daemon, 404, 'not-found', 'GET', `/v1/strands/${a}/quality?with=grm_nothing`);
  const one = await upload(daemon, points(1, 20));
  await refused(daemon, 422, 'empty', 'GET', `/v1/strands/${one}/quality?with=${a}`, { problem: { detail: /halves/ } });
});

test('a groom is compared with its strands, revision by revision', async (t) => {
  const daemon = await startIdleDaemon(t);
  const head = (await expect(daemon, 201, 'POST', '/v1/heads', { body: head_obj() })).json;
  const job = await submit(daemon, { head: head.id }), token = await daemon.attempt();
  await expect(daemon, 204, 'POST', '/v1/work/result', { token, body: groom_document({ n: 20 }) });
  const { json: { result: { groom } } } = await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=30' } });
  const at = `/v1/grooms/${groom}`;

  await t.test('against the strands and the head of the fit, as fitted and as drawn', async () => {
    const { json } = await expect(daemon, 200, 'GET', `${at}/quality`);
    assert.deepEqual([json.id, json.revision, json.target], [groom, 1, job.request?.strands ?? json.target]);
    assert.equal(json.strands.groom, 20);
    assert.deepEqual(json.drawn, json.fitted, 'imported numbers are draws');
    assert.ok(json.fitted.inside_head);
    assert.deepEqual((await expect(daemon, 200, 'GET', `${at}/quality?revision=1`)).json, json, 'it is kept');
  });

  await t.test('an edit has a report of its own', async () => {
    await expect(daemon, 201, 'PATCH', at, { headers: { 'Content-Type': 'application/json-patch+json', 'If-Match': '"1"' }, body: [{ op: 'replace', path: '/operators/1/radius', value: 0.03 }] });
    const first = (await expect(daemon, 200, 'GET', `${at}/quality?revision=1`)).json, second = (await expect(daemon, 200, 'GET', `${at}/quality`)).json;
    assert.equal(second.revision, 2);
    assert.ok(second.fitted.paired.distance > 1.2 * first.fitted.paired.distance);
    const between = (await expect(daemon, 200, 'GET', `${at}/quality?revision=1&with=${groom}`)).json;
    assert.deepEqual([between.revision, between.target, between.target_revision], [1, groom, 2]);
  });

  await t.test('as a page, without anything from elsewhere', async () => {
    const { text, headers } = await expect(daemon, 200, 'GET', `/grooms/${groom}/quality`);
    assert.match(headers.get('content-security-policy'), /default-src 'none'/);
    assert.doesNotMatch(text, /https?:|<script|style=/);
    assert.match(text, /<svg[^]*<path class="groom"/);
    assert.match(text, /3 mm, 30°/);
    for (const [, path] of text.matchAll(/src="([^"]+)"/g))
      assert.equal((await expect(daemon, 200, 'GET', path.replaceAll('&amp;', '&').replace('size=768', 'size=64'))).bytes.subarray(1, 4).toString(), 'PNG');
  });

  await t.test('pictures of target and groom differ, and are refused where they make no sense', async () => {
    const [target, fitted] = await Promise.all(['target', 'groom'].map((of) => expect(daemon, 200, 'GET', `${at}/quality.png?size=64&of=${of}`)));
    assert.notDeepEqual(target.bytes, fitted.bytes);
    await refused(daemon, 400, 'invalid-argument', 'GET', `${at}/quality.png?of=all`, { problem: { parameter: 'of' } });
    await refused(daemon, 400, 'invalid-argument', 'GET', `${at}/quality.png?view=below`, { problem: { parameter: 'view' } });
  });

  await t.test('the report stays when its strands are removed, and goes with the groom', async () => {
    const { target } = (await expect(daemon, 200, 'GET', `${at}/quality`)).json;
    await expect(daemon, 204, 'DELETE', `/v1/strands/${target}`);
    assert.equal((await expect(daemon, 200, 'GET', `${at}/quality`)).json.target, target);
    await refused(daemon, 404, 'not-found', 'GET', `${at}/quality.png`);
    await expect(daemon, 204, 'DELETE', at);
    await refused(daemon, 404, 'not-found', 'GET', `${at}/quality`);
  });
});

test('what a fit measured is stored with its groom; an imported word for it is not', async (t) => {
  const daemon = await startIdleDaemon(t);
  const job = await submit(daemon), token = await daemon.attempt();
  const real = (await expect(daemon, 200, 'GET', `/v1/strands/${job.request?.strands ?? (await expect(daemon, 200, 'GET', '/v1/strands')).json.strands[0].id}/quality?with=${(await expect(daemon, 200, 'GET', '/v1/strands')).json.strands[0].id}`)).json;
  const { id, revision, target, target_revision, ...report } = real;
  report.fitted.spectra.floor = 0.125;
  await expect(daemon, 204, 'POST', '/v1/work/result', { token, body: { ...groom_document({ n: 20 }), quality: report } });
  const { json: { result: { groom } } } = await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=30' } });
  assert.equal((await expect(daemon, 200, 'GET', `/v1/grooms/${groom}/quality`)).json.fitted.spectra.floor, 0.125);
  assert.equal((await expect(daemon, 200, 'GET', `/v1/grooms/${groom}?arrays=false`)).json.quality, undefined);

  const imported = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: { ...groom_document(), source: {}, quality: report } })).json.groom;
  await refused(daemon, 404, 'not-found', 'GET', `/v1/grooms/${imported}/quality`, { problem: { detail: /name some/ } });
  await refused(daemon, 404, 'not-found', 'GET', `/grooms/${imported}/quality`);
  const other = (await expect(daemon, 200, 'GET', `/v1/grooms/${imported}/quality?with=${target}`)).json;
  assert.notEqual(other.fitted.spectra.floor, 0.125);
});
