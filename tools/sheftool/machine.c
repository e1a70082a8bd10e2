#include "sheftool/machine.h"

#include <stdio.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "core/cpu.h"

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

json_t *shef_machine_json(uint32_t cpu_features)
{
    char cpu[128];
    struct utsname name;

    shef_cpu_model(cpu, sizeof cpu);
    return json_pack("{s:s, s:I, s:s, s:s, s:s}", "cpu", cpu, "cpus",
                     (json_int_t)sysconf(_SC_NPROCESSORS_ONLN), "isa",
                     shef_cpu_isa_name(cpu_features), "compiler", COMPILER, "kernel",
                     uname(&name) == 0 ? name.release : "unknown");
}

void shef_machine_text(uint32_t cpu_features, char *out_text, size_t n_bytes)
{
    char cpu[128];

    shef_cpu_model(cpu, sizeof cpu);
    snprintf(out_text, n_bytes, "%s, %ld CPUs, %s, %s", cpu, sysconf(_SC_NPROCESSORS_ONLN),
             shef_cpu_isa_name(cpu_features), COMPILER);
}
