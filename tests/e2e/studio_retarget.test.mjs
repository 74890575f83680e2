// To another head in the studio: carried, looked at in numbers and colours, and with a hairline that is dragged.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { sharedData, slowness, startDaemon, temporaryFolder } from '../support/daemon.mjs';
import { picture, startBrowser } from '../support/browser.mjs';
import { decode } from '../support/api.mjs';
import { drawn, sample, settled, skip } from '../support/studio.mjs';

const axe = readFileSync(new URL('../node_modules/axe-core/axe.min.js', import.meta.url), 'utf8');
const violations = (page) => page.evaluate(`${axe};axe.run(document).then((r) => r.violations.map((v) => v.id + ': ' + v.nodes.map((n) => n.html).join(' ')))`);

/** The head of a sample, wider and a little taller: other.obj beside it. */
function reshape(folder) {
  const at = (x, centre, scale) => centre + (Number(x) - centre) * scale;
  const other = readFileSync(join(folder, 'head.obj'), 'utf8').replace(/^v (\S+) (\S+) (\S+)/gm, (_, x, y, z) => `v ${at(x, 0, 1.12)} ${at(y, 1.63, 1.04)} ${at(z, 0, 1.06)}`);
  writeFileSync(join(folder, 'other.obj'), other);
}

/** Strands and two heads, and the page that carries the first to the second. */
async function opened(t) {
  const daemon = await startDaemon(t), folder = sample(t, '--vertices', '24'), page = await startBrowser(t, daemon, { width: 1100, height: 760 });
  page.setDefaultTimeout(20000 * slowness);
  reshape(folder);
  await page.goto(daemon.url);
  await page.setInputFiles('#files', [join(folder, 'strands.hair'), join(folder, 'head.obj')]);
  await page.getByRole('link', { name: 'carry strands.hair to another head' }).click();
  await page.getByLabel('Source head').selectOption({ label: 'head.obj' });
  await page.getByText('or upload one').click();
  await page.getByLabel('Upload a head').setInputFiles(join(folder, 'other.obj'));
  await page.waitForFunction(() => window.studio?.viewer.head);
  assert.equal(await page.getByLabel('Target head').evaluate((list) => list.selectedOptions[0].textContent), 'other.obj');
  return { daemon, page };
}

/** Waits for the groom that the job under way makes, and its document. */
async function carried({ page, daemon }) {
  await page.getByRole('button', { name: 'Carry it over' }).click();
  await page.waitForURL(/#\/grooms\/grm_/);
  await settled(page, 1);
  await page.waitForFunction(() => window.studio.viewer.head && window.studio.evaluation.lit);
  return daemon.json(`/v1/grooms/${page.url().split('/').at(-1)}`);
}

test('strands go to another head, and say what became of them', { skip, timeout: 120000 }, async (t) => {
  const { daemon, page } = await opened(t);
  await page.locator('input[name=guides]').fill('60');
  const document = await carried({ daemon, page });
  const { job } = document.source, asked = await daemon.json(`/v1/jobs/${job}`);
  assert.equal(asked.options.guides, 60);
  assert.equal(document.source.head, asked.targets[0].head);
  assert.ok(await drawn(page) > 0.1, 'the picture is not empty');
  await t.test('the report is a table', async () => {
    const cells = await page.locator('.report tr').evaluateAll((rows) => Object.fromEntries(rows.map((r) => [r.querySelector('th')?.textContent, Array.from(r.querySelectorAll('td'), (d) => d.textContent)])));
    const { energy, inside } = document.retarget.report, read = (text) => Number(text.replaceAll('\u202f', ''));
    assert.equal(cells['vertices inside'][0], String(inside.before.vertices));
    assert.equal(cells['vertices inside'][1], '0');
    for (const [i, total] of [energy.before.total, energy.after.total].entries()) assert.ok(Math.abs(read(cells.energy[i]) / total - 1) < 0.01, cells.energy[i]);
    assert.match(cells['length over the source’s'][0], /^\d\.\d{3} to \d\.\d{3}$/);
  });
  await page.locator('.report').scrollIntoViewIfNeeded();
  await picture(page, 'studio-retarget-report');
  await t.test('strands are coloured by each of its numbers', async () => {
    const colour = page.getByLabel('colour by'), names = await colour.locator('option').evaluateAll((list) => list.map((o) => o.value));
    assert.deepEqual(names.filter((name) => ['movement', 'depth', 'stretch', 'density'].includes(name)), ['movement', 'depth', 'stretch'], 'no hairline was moved');
    for (const name of ['movement', 'depth', 'stretch']) {
      await colour.selectOption(name);
      await page.locator('.legend').getByText(name === 'stretch' ? '%' : 'mm').waitFor();
      await page.waitForTimeout(300);
      await picture(page, `studio-retarget-${name}`);
      const table = decode(document.retarget.strands[name]), seen = await page.evaluate(() => {
        const { viewer: { groom: { values } }, session: { order, document: { strands: { vertices } } } } = window.studio;
        return Array.from(order, (strand, slot) => [strand, values[slot * vertices], values[(slot + 1) * vertices - 1]]);
      });
      for (const [strand, ...ends] of seen) for (const value of ends) assert.ok(Math.abs(value - (table[strand] - (name === 'stretch'))) < 1e-6, `${name} of ${strand}`);
    }
    assert.deepEqual(await violations(page), []);
  });
  await t.test('and back: the head that a groom is on is preset', async () => {
    const groom = page.url().split('/').at(-1);
    await page.getByRole('link', { name: 'Carry to another head' }).click();
    await page.getByRole('heading', { name: 'Hairline' }).waitFor();
    assert.equal(await page.getByLabel('Source head').inputValue(), document.source.head);
    assert.ok(await page.getByRole('button', { name: 'Carry it over' }).isDisabled());
    await page.getByLabel('Target head').selectOption({ label: 'head.obj' });
    const back = await carried({ daemon, page });
    assert.equal(back.retarget.from.groom, groom);
    assert.equal((await daemon.json(`/v1/heads/${back.source.head}`)).name, 'head.obj');
  });
});

test('a hairline is dragged on the head, moved by arrows, and carried', { skip, timeout: 120000 }, async (t) => {
  const { daemon, page } = await opened(t);
  await page.getByRole('button', { name: 'Edit the hairline' }).click();
  await page.waitForFunction(() => window.studio.editor.handles.length === 11);
  const handles = () => page.evaluate(() => window.studio.editor.handles.map((p) => p.toArray()));
  /* Where a handle is on the page. */
  const place = (i) => page.evaluate((k) => {
    const { viewer, editor } = window.studio, box = viewer.canvas.getBoundingClientRect(), q = editor.handles[k].clone().project(viewer.camera);
    return [box.left + ((q.x + 1) / 2) * box.width, box.top + ((1 - q.y) / 2) * box.height];
  }, i);
  const apart = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
  await page.waitForTimeout(300);
  await picture(page, 'studio-hairline');
  const first = await handles();

  await t.test('by the mouse', async () => {
    const [x, y] = await place(5);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 2, y + 25, { steps: 4 });
    await page.mouse.up();
    const now = await handles();
    assert.ok(now[5][1] < first[5][1] - 0.004, `${first[5]} ${now[5]}`);
    assert.deepEqual(now.filter((_, i) => i !== 5), first.filter((_, i) => i !== 5));
    const [at, far] = await page.evaluate(() => {
      const { editor } = window.studio, of = (p) => editor.surface.closest(p).distanceTo(p);
      return [Math.max(...editor.handles.map(of)), Math.max(...editor.points.map(of))];
    });
    assert.ok(at < 1e-6 && far < 1e-6, 'all of it is on the head');
    assert.ok(await page.evaluate(() => window.studio.viewer.controls.enabled), 'the camera can be turned again');
  });
  await t.test('and by the keyboard, a millimetre at a time', async () => {
    await page.locator('.picture canvas').focus();
    for (let i = 0; i < 6; i++) if (await page.evaluate(() => window.studio.editor.chosen) !== 4) await page.keyboard.press('[');
    const before = (await handles())[4];
    await page.keyboard.press('ArrowUp');
    const moved = apart(before, (await handles())[4]);
    assert.ok(moved > 0.0003 && moved < 0.0012, `${moved}`);
    assert.match(await page.locator('#status').textContent(), /handle 5 of 11/);
  });
  await t.test('or begins at a known shape', async () => {
    for (const [name, file] of [['widow’s peak', 'peak'], ['straight', 'straight'], ['receding', 'receding']]) {
      await page.getByRole('button', { name }).click();
      await page.waitForTimeout(200);
      await picture(page, `studio-hairline-${file}`);
      assert.notDeepEqual(await handles(), first);
    }
    assert.equal(await page.getByLabel('What the line does').inputValue(), 'balding');
    assert.deepEqual(await violations(page), []);
    await page.getByRole('button', { name: 'as it is', exact: true }).click();
    assert.deepEqual(await handles(), first);
    await page.getByText('Not moved').waitFor();
  });
  await t.test('and goes back towards today’s by quarters', async () => {
    await page.getByRole('button', { name: 'widow’s peak' }).click();
    const far = await handles();
    await page.getByRole('button', { name: 'closer to today’s' }).click();
    const near = await handles(), left = near.map((p, i) => apart(p, first[i]) / apart(far[i], first[i]));
    for (const i of [3, 5, 7]) assert.ok(left[i] > 0.65 && left[i] < 0.85, `${left}`);
    await page.getByRole('button', { name: 'as it is', exact: true }).click();
    assert.ok(await page.getByRole('button', { name: 'closer to today’s' }).isDisabled(), 'today’s is as close as it gets');
  });
  await t.test('what lies between handles keeps its shape', async () => {
    const [off, moved] = await page.evaluate(() => {
      const { editor } = window.studio, of = (points) => points.map((p, i) => p.distanceTo(editor.line[i]));
      const still = Math.max(...of(editor.points));
      editor.move(5, editor.handles[5].clone().add({ x: 0, y: -0.006, z: 0 }));
      const by = of(editor.points);
      editor.take('as it is');
      return [still, by];
    });
    assert.ok(off < 1e-6, 'nothing moved: the line is today’s, point by point');
    assert.ok(moved[20] > 0.003 && moved[0] < 1e-6 && moved[10] < moved[20] / 4, `${moved}`);
  });
  await t.test('in a narrow window too', async () => {
    await page.setViewportSize({ width: 420, height: 800 });
    await page.waitForTimeout(300);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'nothing sticks out to the right');
    await picture(page, 'studio-hairline-narrow');
    await page.setViewportSize({ width: 1100, height: 760 });
  });
  await t.test('a line that crosses itself is refused in words, and there to be mended', async () => {
    await page.evaluate(() => {
      const { editor } = window.studio, [a, b] = [3, 7].map((i) => editor.handles[i].clone());
      editor.move(3, b);
      editor.move(7, a);
    });
    const crossed = await handles();
    await page.getByRole('button', { name: 'Carry it over' }).click();
    await page.getByText(/^failed: .*cross/).waitFor();
    await picture(page, 'studio-hairline-refused');
    await page.getByRole('link', { name: 'Back to heads and hairline' }).click();
    await page.waitForFunction(() => window.studio?.editor.moved);
    assert.deepEqual(await handles(), crossed);
  });
  await t.test('roots follow it', async () => {
    await page.getByRole('button', { name: 'widow’s peak' }).click();
    await page.locator('input[name=guides]').fill('60');
    const document = await carried({ daemon, page }), { edit, density_l1 } = document.retarget.hairline;
    assert.equal(edit.kind, 'front');
    assert.equal((await daemon.json(`/v1/jobs/${document.source.job}`)).targets[0].hairline.points.length, 41);
    assert.ok(density_l1 > 0 && density_l1 < 0.5, `${density_l1}`);
    await page.locator('.report').getByText('change of density').waitFor();
    await page.getByLabel('colour by').selectOption('density');
    await page.locator('.legend').getByText('%').waitFor();
    await page.waitForTimeout(300);
    await picture(page, 'studio-retarget-density');
    await page.locator('.commands summary').click();
    const listed = await page.locator('.commands code').allTextContents();
    assert.ok(listed.some((line) => /^printf %s .*"points".* > hairline\.json && groomctl --server \S+ retarget str_\w+ head_\w+ --source head_\w+ --guides 60 --hairline hairline\.json$/.test(line)), listed.join('\n'));
  });
});

/** Every n-th strand of a .data file, as one. */
function thinned(path, n) {
  const bytes = readFileSync(path), kept = [], count = Buffer.alloc(4);
  for (let at = 4, i = 0; at < bytes.length; i++) {
    const size = 4 + 12 * bytes.readInt32LE(at);
    if (i % n === 0) kept.push(bytes.subarray(at, at + size));
    at += size;
  }
  count.writeInt32LE(kept.length);
  return Buffer.concat([count, ...kept]);
}

const [jagged, body] = ['combover/hair.data', 'combover/body.obj'].map(sharedData);
test('a jagged hairline takes a widow’s peak as a smooth one does', { skip: skip || (jagged && body ? false : 'needs ../shared/data/combover'), timeout: 180000 }, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), page = await startBrowser(t, daemon, { width: 1100, height: 760 });
  writeFileSync(join(folder, 'hair.data'), thinned(jagged, 4));
  await page.goto(daemon.url);
  await page.locator('.drop select[name=up]').selectOption('z');
  await page.setInputFiles('#files', [join(folder, 'hair.data'), body]);
  await page.getByRole('link', { name: 'carry hair.data to another head' }).click();
  await page.getByLabel('Source head').selectOption({ label: 'body.obj' });
  await page.getByLabel('Target head').selectOption({ label: 'body.obj' });
  await page.waitForFunction(() => window.studio?.viewer.head);
  await page.getByRole('button', { name: 'Edit the hairline' }).click();
  await page.waitForFunction(() => window.studio.editor.handles.length === 11);
  await page.getByRole('button', { name: 'widow’s peak' }).click();
  await page.waitForTimeout(300);
  await picture(page, 'studio-hairline-jagged');
  const document = await carried({ daemon, page });
  assert.ok(document.retarget.hairline.edit, 'the hair follows the line');
  await picture(page, 'studio-hairline-jagged-carried');
});
