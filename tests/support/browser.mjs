// Debian's Chromium, headless and without a graphics card, for tests of the studio. What a page says
// to its console, what it asks of other hosts and what fails is kept, and must be nothing.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { chromium } from 'playwright-core';
import { build, slowness } from './daemon.mjs';

const EXECUTABLE = '/usr/bin/chromium';
export const hasBrowser = existsSync(EXECUTABLE);

/** A page of the studio of `daemon`; closed, and its complaints looked at, when the test ends. */
export async function startBrowser(t, daemon, { width = 900, height = 600 } = {}) {
  const browser = await chromium.launch({
    executablePath: EXECUTABLE,
    args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
      '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
  });
  const page = await browser.newPage({ viewport: { width, height }, acceptDownloads: true });
  page.setDefaultTimeout(60000 * slowness);
  const complaints = [];
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && !/GL Driver Message|GPU stall/.test(message.text()) && complaints.push(message.text()));
  page.on('pageerror', (error) => complaints.push(error.stack));
  page.on('request', (request) => {
    if (!request.url().startsWith(daemon.url) && !/^(data|blob):/.test(request.url())) complaints.push(`asked for ${request.url()}`);
  });
  t.after(async () => {
    await browser.close();
    assert.deepEqual(complaints, [], 'what the page complained of');
  });
  return page;
}

/** Kept for those who want to look: build/tests/pictures/NAME.png */
export async function picture(page, name) {
  const folder = join(build, 'tests/pictures');
  mkdirSync(folder, { recursive: true });
  return page.screenshot({ path: join(folder, `${name}.png`), timeout: 120000 * slowness });
}
