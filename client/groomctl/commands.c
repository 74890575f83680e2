/* The table of commands: what usage, help and dispatch are made of. */
#include <string.h>

#include "client/groomctl/groomctl.h"

const struct option_spec groomctl_global_options[] = {
    {"server", 0, "URL", "the daemon (GROOM_SERVER; http://127.0.0.1:8080)"},
    {"token", 0, "TOKEN", "who is asking, where the server wants to know (GROOMD_TOKEN)"},
    {"token-file", 0, "FILE", "a file with the token in it (~/.config/groom/token)"},
    {"json", 0, NULL, "JSON for scripts, one object a line"},
    {"help", 'h', NULL, "this, or a command's own help"},
    {0},
};

#define READ_OPTIONS                                                                                  \
    {"unit", 0, "U", "of the file: m, cm, mm, dm, in, or a number of metres (m)"},                     \
    {"up", 0, "A", "its up axis: y or z (y)"},                                                         \
    {"format", 0, "F", "what it is, where its bytes do not tell: hair, monohair, data, ct2hair, ply, " \
                       "tfx, obj, json, npy, npz"},                                                    \
    {"name", 0, "NAME", "what people call it (the file's name)"},                                     \
    {"resumable-from", 0, "BYTES", "files of this size go on where a broken upload ended (16777216)"}

static const struct option_spec upload_options[] = {READ_OPTIONS, {0}};

#define JOB_OPTIONS                                                                                    \
    {"option", 0, "PATH=VALUE", "any other option: stages.initialize.n_smooth=40 (see: groomctl options)"}, \
    {"options", 0, "FILE", "options as a JSON object; the ones above come on top"},                     \
    {"priority", 0, "N", "larger ones go first, -100 to 100 (0)"},                                      \
    {"webhook", 0, "URL", "who is told of the job's end; needs --webhook-secret"},                      \
    {"webhook-secret", 0, "TEXT", "of the message's signature, 16 characters or more"},                 \
    {"wait", 'w', NULL, "follow the job to its end"},                                                   \
    {"output", 'o', "FILE", "wait, then export the strands there, in the unit and axis of the upload"}, \
    {"groom-id-file", 0, "FILE", "wait, then write the groom's id there, for scripts"},                 \
    {"output-format", 0, "F", "of that file, where its extension does not tell"},                       \
    {"head-unit", 0, "U", "of the head's file, where it is not the strands'"},                          \
    {"head-up", 0, "A", "of the head's file, where it is not the strands'"},                            \
    READ_OPTIONS

static const struct option_spec fit_options[] = {
    {"head", 0, "HEAD", "id of an uploaded head, or a file of one"},
    {"head-file", 0, "FILE", "upload this head first"},
    {"guides", 0, "N", "number of guides, or auto"},
    {"operator-guides", 0, "N", "number of operator guides, or auto"},
    {"vertices", 0, "N", "vertices of each strand (100)"},
    {"operators", 0, "LIST", "scale,bend,curl,clump,frizz in the order wanted, or auto"},
    {"quality", 0, "Q", "draft, standard or high"},
    {"seed", 0, "N", "of all random numbers (1)"},
    {"cameras", 0, "FILE", "cameras of the capture, for visibility: cameras.json, transforms.json, or COLMAP's folder of text"},
    JOB_OPTIONS,
    {0},
};

static const struct option_spec retarget_options[] = {
    {"source", 0, "HEAD|FILE", "the head that the hair is on (of a groom: the one it was made with)"},
    {"source-skeleton", 0, "FILE", "its bones, JSON; made of the head where not given"},
    {"skeleton", 0, "FILE", "the same bones in the target; the source's, carried over, where not given"},
    {"landmarks", 0, "FILE", "the same places on both heads, JSON, where their triangles differ"},
    {"hairline", 0, "FILE", "a curve on the target that the hair is to begin at, JSON (see: groomctl hairline)"},
    {"dense", 0, NULL, "of a groom: carry its strands as they are evaluated"},
    {"revision", 0, "N", "of a groom (the latest)"},
    {"guides", 0, "N", "strands that are adapted together (300)"},
    {"iterations", 0, "N", "in each scale, at most (15)"},
    {"mode", 0, "M", "multiscale or global (multiscale)"},
    {"seed", 0, "N", "of the clustering that chooses guides (1)"},
    JOB_OPTIONS,
    {0},
};

static const struct option_spec hairline_options[] = {
    {"source", 0, "HEAD|FILE", "the head that the hair is on (of a groom: the one it was made with)"},
    {"points", 0, "N", "of the line (33)"},
    {"output", 'o', "FILE", "write it there"},
    {"revision", 0, "N", "of a groom (the latest)"},
    {"head-unit", 0, "U", "of the heads' files, where it is not the strands'"},
    {"head-up", 0, "A", "of the heads' files, where it is not the strands'"},
    READ_OPTIONS,
    {0},
};

static const struct option_spec schema_options[] = {{"kind", 0, "KIND", "of job: fit or retarget (fit)"}, {0}};

static const struct option_spec list_options[] = {
    {"limit", 0, "N", "rows at most"},
    {"before", 0, "N", "the page after this place (the list says it)"},
    {"state", 0, "S", "of jobs: queued, running, succeeded, failed, cancelled"},
    {0},
};

static const struct option_spec watch_options[] = {
    {"all", 0, NULL, "every job that runs or waits now"},
    {0},
};

static const struct option_spec page_options[] = {
    {"limit", 0, "N", "rows at most"},
    {"before", 0, "N", "the page after this place (the list says it)"},
    {0},
};

static const struct option_spec save_options[] = {
    {"output", 'o', "FILE", "write it there (standard output)"},
    {0},
};

static const struct option_spec guides_options[] = {
    {"unit", 0, "U", "of the file: m, cm, mm, dm, in, or a number of metres (m)"},
    {"up", 0, "A", "its up axis: y or z (y)"},
    {"format", 0, "F", "what it is, where its bytes do not tell"},
    {"if-match", 0, "N", "refuse unless the latest revision is this one"},
    {0},
};

static const struct option_spec clusters_options[] = {
    {"count", 0, "N", "clusters (8)"},
    {"seed", 0, "N", "of these (1)"},
    {"frames", 0, "N", "of each cluster's armature (4)"},
    {"revision", 0, "N", "of a groom (the latest)"},
    {"output", 'o', "FILE", "write the whole answer there, as JSON"},
    {0},
};

static const struct option_spec get_options[] = {
    {"revision", 0, "N", "of a groom (the latest)"},
    {"arrays", 0, NULL, "with a groom's large arrays"},
    {"output", 'o', "FILE", "write the whole document there"},
    {0},
};

static const struct option_spec export_options[] = {
    {"output", 'o', "FILE", "where to; - is standard output"},
    {"format", 0, "F", "hair, usda, ply, obj, data or json (by the file's extension)"},
    {"guides", 0, NULL, "the guides in place of the dense strands"},
    {"count", 0, "N", "a fair sample of so many strands"},
    {"vertices", 0, "N", "of uploaded strands: each resampled to so many"},
    {"unit", 0, "U", "of the file (m)"},
    {"up", 0, "A", "of the file (y)"},
    {"revision", 0, "N", "the latest where not given"},
    {0},
};

static const struct option_spec analyze_options[] = {
    {"revision", 0, "N", "of a groom (the latest)"},
    {"count", 0, "N", "a fair sample of so many strands"},
    {"elements", 0, "N", "helical elements of each strand; auto takes as few as meet the tolerance (auto)"},
    {"tolerance", 0, "M", "metres between strand and super-helix at most (1 % of a mean segment)"},
    {"straight-below", 0, "F", "turns per metre under which hair is straight (5)"},
    {"wavy-below", 0, "B", "|beta| up to which hair is wavy and not coiled (0.5)"},
    {"arrays", 0, "LIST", "with --json: elements,vertices,centre,switchbacks,strands"},
    {"binary", 0, "FILE", "radius, frequency, hand and beta of each vertex there, as float32"},
    {0},
};

#define CAMERA_OPTIONS                                                                                     \
    {"size", 0, "N", "pixels of a side, or WIDTHxHEIGHT (512)"},                                            \
    {"azimuth", 0, "DEG", "where the camera stands, degrees: 0 before the face, 90 at the person's left"}, \
    {"elevation", 0, "DEG", "how high it stands, degrees: 90 looks down from above"},                       \
    {"light", 0, "L", "camera: the lights go with the camera; front: they stand, as in the studio (camera)"}, \
    {"revision", 0, "N", "the latest where not given"}

static const struct option_spec preview_options[] = {
    {"output", 'o', "FILE", "where to, a PNG; - is standard output"},
    {"view", 0, "V", "front, side, back or top, in place of a camera of your own"},
    {"distance", 0, "M", "of the camera from what it looks at, metres (far enough for all of the hair)"},
    {"target", 0, "X,Y,Z", "what it looks at, metres (the middle of the hair)"},
    {"eye", 0, "X,Y,Z", "where it stands, metres, in place of azimuth, elevation and distance; needs --target"},
    {"fov", 0, "DEG", "from the lower to the upper edge of the picture, degrees (20)"},
    CAMERA_OPTIONS,
    {0},
};

static const struct option_spec turntable_options[] = {
    {"output", 'o', "FILE", "where to, an animated PNG; - is standard output"},
    {"stills", 0, "FOLDER", "each frame as a PNG of its own there, frame_0000.png and so on, for an editor of films"},
    {"frames", 0, "N", "of one turn (36)"},
    {"seconds", 0, "S", "that one turn lasts (a tenth a frame)"},
    CAMERA_OPTIONS,
    {0},
};

static const struct option_spec compare_options[] = {
    {"revision", 0, "N", "of GROOM (the latest)"},
    {"unit", 0, "U", "of files: m, cm, mm, dm, in, or a number of metres (m)"},
    {"up", 0, "A", "their up axis: y or z (y)"},
    {"head-file", 0, "FILE", "of files: the head, in the same unit, for what is inside it"},
    {"picture", 0, "FILE", "no numbers: a PNG with the camera of the target's picture"},
    {"of", 0, "WHAT", "in the picture: groom, target, or drawn (random numbers from its seeds)"},
    {"view", 0, "V", "of the picture: front, side, back or top"},
    {"size", 0, "N", "of the picture, pixels of a side (512)"},
    {0},
};

static const struct option_spec edit_options[] = {
    {"if-match", 0, "N", "refuse unless the latest revision is this one"},
    {0},
};

#define LAYER_OPTIONS                                                                                                  \
    {"layer", 0, "ID", "change this layer of the chain; what is not named here stays as it is (a new one, at the end)"}, \
    {"elements", 0, "N", "helical elements of each strand, or auto (auto)"},                                           \
    {"head", 0, "HEAD", "of uploaded strands: the head that the groom is to have"},                                    \
    {"body", 0, "FILE", "the edit as JSON; options come on top"},                                                      \
    {"try", 0, NULL, "say what it would do, and write nothing"},                                                       \
    {"wait", 'w', NULL, "where it becomes a job, wait for its end"},                                                   \
    {"if-match", 0, "N", "refuse unless the latest revision is this one"}
#define GROUP_OPTIONS {"groups", 0, "G", "all, operator_guides, or a number of k-means clusters (all)"}

static const struct option_spec ruffle_options[] = {
    {"rho", 0, "R", "how much is exchanged, 0..1 (0.3)"},
    {"match-elements", 0, "N", "elements next to the root that stay (4)"},
    {"blend", 0, "B", "how far each goes, 0..1 (1)"},
    {"seed", 0, "N", "another seed, another head (1)"},
    GROUP_OPTIONS,
    LAYER_OPTIONS,
    {0},
};

static const struct option_spec sculpt_options[] = {
    {"anchor", 0, "STRAND,AT,X,Y,Z", "a control point (AT: 0 root, 1 tip) and where it goes, metres; any number of them"},
    {"anchors", 0, "FILE", "anchors as JSON"},
    {"clusters", 0, "N", "k-means clusters that frames move"},
    {"cluster-seed", 0, "N", "of these (1)"},
    {"frames", 0, "FILE", "moved frames as JSON: [{\"cluster\",\"at\",\"transform\"},...]"},
    {"stiffness", 0, "C", "how much curls resist, cm^4 (10)"},
    {"through-head", 0, NULL, "do not push strands out of the head"},
    LAYER_OPTIONS,
    {0},
};

static const struct option_spec interpolate_options[] = {
    {"t", 0, "T", "0: this groom, 1: the other (0.5)"},
    {"groom", 0, "GROOM", "the other groom"},
    {"revision", 0, "N", "of the other groom, or of this one"},
    {"strands", 0, "STRANDS", "uploaded strands as the other side"},
    LAYER_OPTIONS,
    {0},
};

static const struct option_spec curl_scale_options[] = {
    {"radius", 0, "F", "factor of each curl's radius (1)"},
    {"step", 0, "F", "factor of the rise of each turn (1)"},
    {"ramp", 0, "ROOT,TIP", "how much of the change there is at root and tip, 0..1 (1,1)"},
    {"keep", 0, "WHAT", "length or turns (length)"},
    {"largest-radius", 0, "M", "wider bends are not curls and stay (0: all are)"},
    {"group", 0, "N", "change this group alone"},
    {"free-direction", 0, NULL, "let strands turn about their roots"},
    GROUP_OPTIONS,
    LAYER_OPTIONS,
    {0},
};

static const struct option_spec sample_options[] = {
    {"output", 'o', "FOLDER", "gets strands.hair, head.obj, truth.groom.json and cameras.json"},
    {"style", 0, "S", "straight, wavy, curly, coily, short, spiky or bent (curly)"},
    {"strands", 0, "N", "of the truth"},
    {"vertices", 0, "N", "of each strand"},
    {"guides", 0, "N", "of the truth"},
    {"seed", 0, "N", "another head of hair (1)"},
    {"clean", 0, NULL, "without the defects of a capture"},
    {0},
};

#define MANY ARGUMENTS_MAX
const struct command groomctl_commands[] = {
    {"upload", "FILE", 1, 1, upload_options, "upload dense strands", command_upload},
    {"upload-head", "FILE", 1, 1, upload_options, "upload a head or body mesh (OBJ, PLY)", command_upload_head},
    {"fit", "STRANDS|FILE", 1, 1, fit_options, "fit a procedural groom; with -o all the way from file to file", command_fit},
    {"retarget", "STRANDS|GROOM|FILE HEAD|FILE...", 2, 17, retarget_options, "carry a hairstyle to other heads; with -o to a file", command_retarget},
    {"hairline", "STRANDS|GROOM|FILE HEAD|FILE", 2, 2, hairline_options, "its front hairline on another head, as JSON to edit", command_hairline},
    {"status", "JOB...", 1, MANY, NULL, "where jobs stand", command_status},
    {"watch", "JOB...", 0, MANY, watch_options, "follow jobs live, to their ends", command_watch},
    {"cancel", "JOB...", 1, MANY, NULL, "stop jobs", command_cancel},
    {"losses", "JOB", 1, 1, NULL, "the loss curves of a job", command_losses},
    {"deliveries", "JOB", 1, 1, NULL, "who is told of a job's end by a webhook, and how far that is", command_deliveries},
    {"list", "strands|heads|jobs|grooms", 1, 1, list_options, "what is on the server, newest first", command_list},
    {"get", "ID", 1, 1, get_options, "all about strands, a head, a job, a groom or an upload under way", command_get},
    {"delete", "ID...", 1, MANY, NULL, "remove strands, heads, whole grooms or uploads under way; there is no way back", command_delete},
    {"export", "GROOM|STRANDS|HEAD", 1, 1, export_options, "strands or guides into a file; a head as it was uploaded", command_export},
    {"analyze", "GROOM|STRANDS", 1, 1, analyze_options, "what kind of hair it is: curls, handedness, switchbacks", command_analyze},
    {"clusters", "GROOM|STRANDS", 1, 1, clusters_options, "strands by cluster, and the frames that a sculpt moves", command_clusters},
    {"preview", "GROOM", 1, 1, preview_options, "a shaded picture, from a view or a camera of your own", command_preview},
    {"turntable", "GROOM", 1, 1, turntable_options, "a turn around it: an animated PNG, or its frames", command_turntable},
    {"compare", "GROOM|STRANDS|FILE [TARGET]", 1, 2, compare_options,
     "how alike strands are to a target; a groom's own is what it was fitted to; two files need no server", command_compare},
    {"set", "GROOM /POINTER=VALUE...", 2, MANY, edit_options, "change a groom: /operators/2/radius=0.01", command_set},
    {"patch", "GROOM FILE", 2, 2, edit_options, "change a groom by a JSON Patch or merge patch", command_patch},
    {"set-guides", "GROOM FILE", 2, 2, guides_options, "replace the guides of a groom, as many as it has", command_set_guides},
    {"ruffle", "GROOM|STRANDS", 1, 1, ruffle_options, "exchange pieces of hair between strands", command_ruffle},
    {"sculpt", "GROOM|STRANDS", 1, 1, sculpt_options, "move control points or clusters, the curls kept", command_sculpt},
    {"interpolate", "GROOM|STRANDS", 1, 1, interpolate_options, "blend with another groom, revision or upload", command_interpolate},
    {"curl-scale", "GROOM|STRANDS", 1, 1, curl_scale_options, "make curls wider or narrower, steeper or flatter", command_curl_scale},
    {"revisions", "GROOM", 1, 1, page_options, "the history of a groom", command_revisions},
    {"revert", "GROOM REVISION", 2, 2, edit_options, "a new revision that is the same as an earlier one", command_revert},
    {"import", "FILE", 1, 1, NULL, "a groom document of another server", command_import},
    {"sample", "", 0, 0, sample_options, "make a reconstruction with known truth, without a server", command_sample},
    {"options", "", 0, 0, schema_options, "every option of a kind of job, with its default", command_options},
    {"health", "", 0, 0, NULL, "whether the server is alive and ready", command_health},
    {"whoami", "", 0, 0, NULL, "whose token this is, what for, within which limits", command_whoami},
    {"audit", "", 0, 0, page_options, "who changed what, newest first (scope admin)", command_audit},
    {"metrics", "", 0, 0, save_options, "the server's figures, as Prometheus reads them (scope admin)", command_metrics},
    {"openapi", "", 0, 0, save_options, "the whole interface as OpenAPI 3.1", command_openapi},
    {"completion", "bash|zsh", 1, 1, NULL, "completion for a shell: source <(groomctl completion bash)", command_completion},
    {"manual", "", 0, 0, NULL, "the man page: groomctl manual | man -l -", command_manual},
    {0},
};

const struct command *groomctl_find_command(const char *name)
{
    for (const struct command *c = groomctl_commands; c->name; c++)
        if (!strcmp(c->name, name)) return c;
    return NULL;
}
