#include "service/kernels.h"

#include "codecs/kernels/evt_run.h"
#include "core/cpu.h"
#include "core/kernels/crc32c.h"
#include "pipeline/kernels/decay.h"
#include "pipeline/kernels/edge.h"
#include "pipeline/kernels/gradient.h"
#include "pipeline/kernels/match.h"
#include "pipeline/kernels/rectify.h"
#include "pipeline/kernels/warp.h"

json_t *shef_kernels_to_json(uint32_t cpu_features)
{
    const struct {
        const char *name;
        const char *isa;
        const char *does;
    } rows[] = {
        { "evt_run", shef_evt_kernels_for(cpu_features)->isa, "decodes runs of events" },
        { "decay", shef_decay_pick(cpu_features)->isa, "lets the filter's state decay" },
        { "warp", shef_warp_pick(cpu_features)->isa, "rectifies the event view" },
        { "edge", shef_edge_pick(cpu_features)->isa, "turns the event view into an edge map" },
        { "rectify", shef_rectify_pick(cpu_features)->isa, "rectifies the frame" },
        { "gradient", shef_gradient_pick(cpu_features)->isa, "finds the frame's gradients" },
        { "match", shef_match_pick(cpu_features)->isa, "correlates edge maps" },
        { "crc32c", shef_crc32c_pick(cpu_features)->isa, "checksums blocks and messages" },
    };
    json_t *list = json_array();
    char cpu[128];

    shef_cpu_model(cpu, sizeof cpu);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        json_array_append_new(list, json_pack("{s:s, s:s, s:s}", "name", rows[i].name, "isa",
                                              rows[i].isa, "does", rows[i].does));
    return json_pack("{s:s, s:s, s:o}", "cpu", cpu, "isa", shef_cpu_isa_name(cpu_features),
                     "kernels", list);
}
