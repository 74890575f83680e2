// A groomd below which calls fail as the test says (tests/faults/libfault.c).
import { closeSync, openSync, readSync, writeFileSync, writeSync } from 'node:fs';
import { constants, tmpdir } from 'node:os';
import { join } from 'node:path';
import { mkdtempSync, rmSync } from 'node:fs';
import { build } from './daemon.mjs';
import { startIdleDaemon } from './api.mjs';

export const kinds = ['write', 'sync', 'rename', 'create', 'truncate', 'remove', 'allocate', 'read', 'spawn'];
const SIZE = 32 + 8 * kinds.length;

export class Faults {
  constructor(path) {
    this.path = path;
    const start = Buffer.alloc(SIZE);
    start.writeInt32LE(-1, 0);
    writeFileSync(path, start);
    this.fd = openSync(path, 'r+');
  }

  #read() { const bytes = Buffer.alloc(SIZE); readSync(this.fd, bytes, 0, SIZE, 0); return bytes; }

  /** The nth call of a kind from now on fails; goes_on: all from there on. error: 'EIO'; 0: half is written. */
  arm(kind, nth, error, goes_on = false) {
    const bytes = Buffer.alloc(32);
    bytes.writeInt32LE(error ? constants.errno[error] : 0, 4);
    bytes.writeBigInt64LE(BigInt(nth), 8);
    bytes.writeInt32LE(goes_on ? 1 : 0, 16);
    writeSync(this.fd, bytes, 4, 16, 4);
    bytes.writeInt32LE(kinds.indexOf(kind), 0);
    writeSync(this.fd, bytes, 0, 4, 0); // last: now it counts
  }

  disarm() { const none = Buffer.alloc(4); none.writeInt32LE(-1); writeSync(this.fd, none, 0, 4, 0); }
  get failed() { return Number(this.#read().readBigInt64LE(24)); }
  get counts() { const bytes = this.#read(); return Object.fromEntries(kinds.map((kind, i) => [kind, Number(bytes.readBigInt64LE(32 + 8 * i))])); }
  close() { closeSync(this.fd); }
}

/** { daemon, faults }: a daemon whose attempts are the test's, over a disk that does as it is told. */
export async function startFaultyDaemon(t, options = {}) {
  const folder = mkdtempSync(join(tmpdir(), 'groomd-faults-'));
  const faults = new Faults(join(folder, 'control'));
  const daemon = await startIdleDaemon(t, {
    ...options, env: { LD_PRELOAD: join(build, 'tests/libfault.so'), GROOM_FAULT: join(folder, 'control'), GROOM_FAULT_FOLDER: tmpdir(), ASAN_OPTIONS: 'verify_asan_link_order=0', ...options.env },
  });
  t.after(() => { faults.disarm(); faults.close(); rmSync(folder, { recursive: true, force: true }); });
  return { daemon, faults };
}
