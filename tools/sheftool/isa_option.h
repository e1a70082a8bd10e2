/* The option --isa, as every command has it. */
#ifndef SHEFTOOL_ISA_OPTION_H
#define SHEFTOOL_ISA_OPTION_H

#include "core/cpu.h"
#include "sheftool/option.h"

/* Its row: field_ is an int32_t. */
#define SHEF_OPT_ISA(type_, field_, help_)                                                         \
    SHEF_OPT_CHOICE("isa", type_, field_, SHEF_CPU_CHOICES, "best", help_)

/* The features to use.
 *   isa  the option's value
 * SHEF_ERR_UNSUPPORTED: this processor lacks them. */
SHEF_MUST_CHECK enum shef_err shef_isa_option(int32_t isa, uint32_t *out_features,
                                              struct shef_error *err);

#endif
