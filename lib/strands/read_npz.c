/* NumPy .npz: a zip of .npy arrays (PKWARE's APPNOTE 6.3), read front to back without the directory,
 * so that it may come from a pipe. DiffLocks: `positions` [strands, 256, 3] and, in its data
 * set, `root_uv`. Entries are stored or deflated; a zip64 size in a local header is read; a
 * data descriptor is found by the length of the array or the end of the deflate stream. Checksums are
 * compared. What is inflated may grow no more than RATIO_MAX fold, which no captured hair comes near;
 * arrays that are not wanted are passed over without inflating where their size is known. */
#include <string.h>
#include <zlib.h>

#include "strands/npy.h"

#define MAX_NAME   256
#define RATIO_MAX  64
#define RATIO_FROM (16u << 20) /* checked once this much was inflated */

enum {
    LOCAL = 0x04034b50,
    CENTRAL = 0x02014b50,
    END = 0x06054b50,
    END64 = 0x06064b50,
    LOCATOR64 = 0x07064b50,
    DESCRIPTOR = 0x08074b50
};
enum { STORED = 0, DEFLATED = 8 };
enum { ENCRYPTED = 1, HAS_DESCRIPTOR = 8 };

struct entry {
    char name[MAX_NAME];
    unsigned flags, method;
    uint32_t crc;
    uint64_t packed, unpacked; /* sizes; meaningless with HAS_DESCRIPTOR */
    uint64_t offset;           /* of its data in the archive */
};

/* The unpacked bytes of an entry, as a source for an input of their own. */
struct unpacker {
    struct reader *reader;
    const struct entry *entry;
    z_stream inflater;
    int inflating, ended;
    uint64_t n_in, n_out;
    uint64_t limit; /* stored: bytes of data, once known */
    uint32_t crc;
    groom_status status; /* why it fails */
    const char *why;
};

/* --- memory for zlib: the size is kept in front ---------------------------------------------- */

static voidpf allocate(voidpf user, uInt n, uInt size)
{
    const struct groom_allocator *allocator = user;
    size_t bytes = (size_t)n * size + 64;
    unsigned char *memory = memory_array(allocator, bytes, 1);
    if (!memory)
        return Z_NULL;
    memcpy(memory, &bytes, sizeof bytes);
    return memory + 64;
}

static void release(voidpf user, voidpf memory)
{
    size_t bytes;
    memcpy(&bytes, (unsigned char *)memory - 64, sizeof bytes);
    memory_release(user, (unsigned char *)memory - 64, bytes, 1);
}

/* --- unpacking --------------------------------------------------------------------------------- */

static int64_t fail_unpacking(struct unpacker *unpacker, groom_status status, const char *why)
{
    unpacker->status = status;
    unpacker->why = why;
    return -1;
}

static int64_t read_stored(struct unpacker *unpacker, void *buffer, size_t capacity)
{
    struct input *in = unpacker->reader->in;
    uint64_t left = unpacker->limit - unpacker->n_out;
    if (left == 0)
        return 0;
    size_t n = input_fill(in, 1);
    if (n == 0)
        return fail_unpacking(unpacker, GROOM_ETRUNCATED, "the archive ends inside it");
    n = n < capacity ? n : capacity;
    n = n < left ? n : (size_t)left;
    memcpy(buffer, in->buffer + in->at, n);
    in->at += n;
    return (int64_t)n;
}

/* One call of inflate on what the window holds; how many bytes came out, or -1. */
static int64_t inflate_some(struct unpacker *unpacker, void *buffer, size_t capacity)
{
    struct input *in = unpacker->reader->in;
    z_stream *z = &unpacker->inflater;
    size_t available = input_fill(in, 1);
    if (available == 0)
        return fail_unpacking(unpacker, GROOM_ETRUNCATED, "the archive ends inside it");
    z->next_in = in->buffer + in->at;
    z->avail_in = (uInt)available;
    z->next_out = buffer;
    z->avail_out = (uInt)capacity;
    int result = inflate(z, Z_NO_FLUSH);
    in->at += available - z->avail_in;
    unpacker->n_in += available - z->avail_in;
    if (result == Z_STREAM_END)
        unpacker->ended = 1;
    else if (result == Z_MEM_ERROR)
        return fail_unpacking(unpacker, GROOM_ENOMEM, "no memory to inflate it");
    else if (result != Z_OK)
        return fail_unpacking(unpacker, GROOM_EFORMAT, "its deflate stream is damaged");
    return (int64_t)(capacity - z->avail_out);
}

static int64_t read_deflated(struct unpacker *unpacker, void *buffer, size_t capacity)
{
    int64_t n = 0;
    while (n == 0 && !unpacker->ended)
        n = inflate_some(unpacker, buffer, capacity);
    if (n > 0 && unpacker->n_out > RATIO_FROM && unpacker->n_out / RATIO_MAX > unpacker->n_in)
        return fail_unpacking(unpacker, GROOM_ETOOBIG, "it inflates more than 64 fold, as no strands do");
    return n;
}

static int64_t read_unpacked(void *user, void *buffer, size_t capacity)
{
    struct unpacker *unpacker = user;
    int64_t n = unpacker->inflating ? read_deflated(unpacker, buffer, capacity)
                                    : read_stored(unpacker, buffer, capacity);
    if (n > 0) {
        unpacker->crc = (uint32_t)crc32(unpacker->crc, buffer, (uInt)n);
        unpacker->n_out += (uint64_t)n;
    }
    return n;
}

static groom_status open_unpacker(struct unpacker *unpacker, struct reader *reader, const struct entry *entry)
{
    *unpacker = (struct unpacker){.reader = reader, .entry = entry, .inflating = entry->method == DEFLATED};
    unpacker->limit = entry->flags & HAS_DESCRIPTOR ? UINT64_MAX : entry->unpacked;
    if (!unpacker->inflating)
        return GROOM_OK;
    unpacker->inflater.zalloc = allocate;
    unpacker->inflater.zfree = release;
    unpacker->inflater.opaque = (voidpf)memory_allocator(reader->context);
    if (inflateInit2(&unpacker->inflater, -MAX_WBITS) == Z_OK)
        return GROOM_OK;
    unpacker->inflating = 0;
    return groom_fail_at(reader->diag, GROOM_ENOMEM, (int64_t)entry->offset, "no memory to inflate %s",
                         entry->name);
}

static void close_unpacker(struct unpacker *unpacker)
{
    if (unpacker->inflating)
        inflateEnd(&unpacker->inflater);
}

/* --- arrays ---------------------------------------------------------------------------------------- */

static int is_named(const struct entry *entry, const char *name)
{
    size_t n = strlen(name);
    return strncmp(entry->name, name, n) == 0 &&
           (entry->name[n] == 0 || strcmp(entry->name + n, ".npy") == 0);
}

/* Refuse more than the limit before anything is unpacked; reserve nothing: a header costs nothing. */
static groom_status read_positions(struct reader *reader, struct input *in, const struct npy *npy)
{
    if (npy->n / 3 > reader->out->max_vertices)
        return groom_fail_at(reader->diag, GROOM_ETOOBIG, 0, "%llu vertices; the limit here is %llu",
                             (unsigned long long)npy->n / 3, (unsigned long long)reader->out->max_vertices);
    return npy_read_positions(reader, in, npy);
}

/* An entry that is wanted, or one whose end only its array's length tells. */
static groom_status read_array(struct reader *reader, struct unpacker *unpacker, struct input *in)
{
    const struct entry *entry = unpacker->entry;
    int positions = is_named(entry, "positions"), root_uv = is_named(entry, "root_uv");
    struct npy npy = {0};
    groom_status status = positions || root_uv ? npy_read_header(in, &npy, reader->diag)
                                               : npy_read_any_header(in, &npy, reader->diag);
    if (status != GROOM_OK)
        return status;
    if (positions && reader->report->n_strands_in_file > 0)
        return groom_fail_at(reader->diag, GROOM_EFORMAT, 0, "a second array of positions");
    status = positions ? read_positions(reader, in, &npy)
             : root_uv ? npy_read_root_uv(reader, in, &npy)
                       : input_skip(in, npy.n * npy.size, "the values of an array", reader->diag);
    return status;
}

/* Put the place in the archive and the array's name before what a reader of its bytes said. */
static groom_status explain(struct reader *reader, const struct unpacker *unpacker, groom_status status)
{
    const struct entry *entry = unpacker->entry;
    int64_t offset = (int64_t)input_offset(reader->in);
    struct groom_diag inner = {0};
    if (reader->diag)
        inner = *reader->diag;
    if (reader->in->status != GROOM_OK)
        return input_fail(reader->in, entry->name, reader->diag);
    if (unpacker->status != GROOM_OK)
        return groom_fail_at(reader->diag, unpacker->status, offset,
                             "array %.40s, by byte %lld of the archive: %s", entry->name, (long long)offset,
                             unpacker->why);
    return groom_fail_at(reader->diag, status, offset, "array %.40s, by byte %lld of the archive: %.250s",
                         entry->name, (long long)offset, inner.detail);
}

/* A stored entry of unknown length ends with its array: its input must not read beyond that. */
static groom_status limit_to_array(struct reader *reader, struct unpacker *unpacker)
{
    struct input ahead = *reader->in; /* a look at the header, from the window alone */
    struct npy npy = {0};
    size_t n = input_fill(reader->in, 8192);
    if (n == 0)
        return input_fail(reader->in, "the header of an array", reader->diag);
    ahead = *reader->in;
    ahead.at_end = 1;
    groom_status status = npy_read_any_header(&ahead, &npy, reader->diag);
    if (status != GROOM_OK)
        return status;
    unpacker->limit = input_offset(&ahead) - input_offset(reader->in) + npy.n * npy.size;
    return GROOM_OK;
}

static groom_status unpack_to_end(struct input *in)
{
    while (input_fill(in, 1) > 0)
        in->at = in->end;
    return in->status;
}

static int is_wanted(const struct entry *entry)
{
    return is_named(entry, "positions") || is_named(entry, "root_uv");
}

static groom_status read_entry_data(struct reader *reader, const struct entry *entry,
                                    struct unpacker *unpacker)
{
    struct groom_source source = {read_unpacked, unpacker, -1};
    struct input in = {0};
    groom_status status = open_unpacker(unpacker, reader, entry);
    if (status != GROOM_OK)
        return status;
    if (!unpacker->inflating && entry->flags & HAS_DESCRIPTOR)
        status = limit_to_array(reader, unpacker);
    if (status == GROOM_OK)
        status = input_init(&in, &source, reader->context, reader->diag);
    if (status == GROOM_OK && is_wanted(entry))
        status = read_array(reader, unpacker, &in);
    if (status == GROOM_OK)
        status = unpack_to_end(&in);
    input_finish(&in);
    close_unpacker(unpacker);
    return status == GROOM_OK ? GROOM_OK : explain(reader, unpacker, status);
}

/* --- entries ---------------------------------------------------------------------------------------- */

/* The extra fields may hold the sizes in 64 bits. */
static void read_zip64_sizes(const unsigned char *extra, size_t n, struct entry *entry)
{
    size_t length;
    for (size_t at = 0; at + 4 <= n; at += 4 + length) {
        length = input_u16(extra + at + 2);
        if (input_u16(extra + at) != 1 || length < 16 || at + 4 + length > n)
            continue;
        entry->unpacked = input_u64(extra + at + 4);
        entry->packed = input_u64(extra + at + 12);
    }
}

/* After the signature. */
static groom_status read_local_header(struct reader *reader, struct entry *entry)
{
    const unsigned char *b;
    uint64_t begin = input_offset(reader->in) - 4;
    groom_status status = input_take(reader->in, 26, "the header of an archive's entry", &b, reader->diag);
    if (status != GROOM_OK)
        return status;
    *entry = (struct entry){.flags = input_u16(b + 2),
                            .method = input_u16(b + 4),
                            .crc = input_u32(b + 10),
                            .packed = input_u32(b + 14),
                            .unpacked = input_u32(b + 18)};
    size_t name_length = input_u16(b + 22), extra_length = input_u16(b + 24);
    if ((status = input_take(reader->in, name_length, "the name of an entry", &b, reader->diag)) != GROOM_OK)
        return status;
    memcpy(entry->name, b, name_length < MAX_NAME ? name_length : MAX_NAME - 1);
    if ((status = input_take(reader->in, extra_length, "the extra fields of an entry", &b, reader->diag)) !=
        GROOM_OK)
        return status;
    if (entry->packed == UINT32_MAX || entry->unpacked == UINT32_MAX)
        read_zip64_sizes(b, extra_length, entry);
    entry->offset = input_offset(reader->in);
    if (entry->flags & ENCRYPTED || (entry->method != STORED && entry->method != DEFLATED))
        return groom_fail_at(reader->diag, GROOM_EFORMAT, (int64_t)begin,
                             "entry %.40s at byte %llu is %s; stored or deflated was expected", entry->name,
                             (unsigned long long)begin,
                             entry->flags & ENCRYPTED ? "encrypted" : "compressed in another way");
    return GROOM_OK;
}

static int is_signature(const unsigned char *bytes)
{
    uint32_t signature = input_u32(bytes);
    return signature == LOCAL || signature == CENTRAL || signature == END;
}

/* crc and sizes of 4 or 8 bytes, with a signature or without: what follows is a signature again. */
static groom_status read_descriptor(struct reader *reader, struct entry *entry)
{
    const unsigned char *b;
    size_t n = input_fill(reader->in, 28), at;
    b = reader->in->buffer + reader->in->at;
    at = n >= 4 && input_u32(b) == DESCRIPTOR ? 4 : 0;
    size_t size = n >= at + 16 && is_signature(b + at + 12) ? at + 12 : at + 20;
    groom_status status = input_take(reader->in, size, "the descriptor of an entry", &b, reader->diag);
    if (status != GROOM_OK)
        return status;
    entry->crc = input_u32(b + at);
    entry->packed = size - at == 12 ? input_u32(b + at + 4) : input_u64(b + at + 4);
    entry->unpacked = size - at == 12 ? input_u32(b + at + 8) : input_u64(b + at + 12);
    return GROOM_OK;
}

static groom_status read_entry(struct reader *reader)
{
    struct entry entry;
    struct unpacker unpacker;
    groom_status status = read_local_header(reader, &entry);
    if (status == GROOM_OK && !is_wanted(&entry) && !(entry.flags & HAS_DESCRIPTOR))
        return input_skip(reader->in, entry.packed, "the data of an entry", reader->diag);
    if (status == GROOM_OK)
        status = read_entry_data(reader, &entry, &unpacker);
    if (status == GROOM_OK && entry.flags & HAS_DESCRIPTOR)
        status = read_descriptor(reader, &entry);
    if (status == GROOM_OK && (unpacker.crc != entry.crc || unpacker.n_out != entry.unpacked ||
                               (unpacker.inflating && unpacker.n_in != entry.packed)))
        return groom_fail_at(
            reader->diag, GROOM_EFORMAT, (int64_t)entry.offset,
            "entry %.40s at byte %llu does not have the size or the checksum that the archive says",
            entry.name, (unsigned long long)entry.offset);
    return status;
}

/* --- the directory, so that a cut is seen ------------------------------------------------------------- */

static groom_status skip_record(struct reader *reader, size_t fixed, const size_t *lengths_at,
                                size_t n_lengths)
{
    const unsigned char *b;
    uint64_t more = 0;
    groom_status status = input_take(reader->in, fixed - 4, "the archive's directory", &b, reader->diag);
    if (status != GROOM_OK)
        return status;
    for (size_t i = 0; i < n_lengths; i++)
        more += input_u16(b + lengths_at[i] - 4);
    return input_skip(reader->in, more, "the archive's directory", reader->diag);
}

static groom_status skip_end64(struct reader *reader)
{
    const unsigned char *b;
    groom_status status = input_take(reader->in, 8, "the archive's directory", &b, reader->diag);
    return status == GROOM_OK ? input_skip(reader->in, input_u64(b), "the archive's directory", reader->diag)
                              : status;
}

/* One record with its signature; *done after the last. */
static groom_status read_record(struct reader *reader, int *done)
{
    static const size_t central_lengths[] = {28, 30, 32}, end_lengths[] = {20};
    const unsigned char *b;
    uint64_t begin = input_offset(reader->in);
    groom_status status = input_take(reader->in, 4, "the next entry of the archive", &b, reader->diag);
    if (status != GROOM_OK)
        return status;
    switch (input_u32(b)) {
    case LOCAL:
        return read_entry(reader);
    case CENTRAL:
        return skip_record(reader, 46, central_lengths, 3);
    case END64:
        return skip_end64(reader);
    case LOCATOR64:
        return skip_record(reader, 20, NULL, 0);
    case END:
        *done = 1;
        return skip_record(reader, 22, end_lengths, 1);
    default:
        return groom_fail_at(reader->diag, GROOM_EFORMAT, (int64_t)begin,
                             "the next entry of the zip archive was expected at byte %llu",
                             (unsigned long long)begin);
    }
}

groom_status read_npz(struct reader *reader)
{
    int done = 0;
    groom_status status = GROOM_OK;
    reader->out->keeps_root_uv = 1;
    while (!done && status == GROOM_OK)
        status = read_record(reader, &done);
    if (status == GROOM_OK && reader->report->n_strands_in_file == 0)
        return groom_fail_at(reader->diag, GROOM_EFORMAT, (int64_t)input_offset(reader->in),
                             "the archive that ends at byte %llu has no array \"positions\" with strands",
                             (unsigned long long)input_offset(reader->in));
    return status;
}
