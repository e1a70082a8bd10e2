#include "shefsim/yaml_lines.h"

#include <string.h>
#include <yaml.h>

/* The value that belongs to a key; NULL if there is none. */
static yaml_node_t *value_of(yaml_document_t *document, const yaml_node_t *mapping, const char *key,
                             int *out_line)
{
    if (!mapping || mapping->type != YAML_MAPPING_NODE)
        return NULL;
    for (const yaml_node_pair_t *pair = mapping->data.mapping.pairs.start;
         pair < mapping->data.mapping.pairs.top; pair++) {
        const yaml_node_t *name = yaml_document_get_node(document, pair->key);

        if (name->type == YAML_SCALAR_NODE &&
            strcmp((const char *)name->data.scalar.value, key) == 0) {
            *out_line = (int)name->start_mark.line + 1;
            return yaml_document_get_node(document, pair->value);
        }
    }
    return NULL;
}

static int line_in(yaml_document_t *document, const char *list, int32_t item, const char *field)
{
    yaml_node_t *node = yaml_document_get_root_node(document);
    int line = 1;

    if (list) {
        node = value_of(document, node, list, &line);
        if (!node || node->type != YAML_SEQUENCE_NODE ||
            item >= node->data.sequence.items.top - node->data.sequence.items.start)
            return line;
        node = yaml_document_get_node(document, node->data.sequence.items.start[item]);
        line = (int)node->start_mark.line + 1;
    }
    value_of(document, node, field, &line);
    return line;
}

int sim_yaml_line(const uint8_t *text, size_t n_bytes, const char *list, int32_t item,
                  const char *field)
{
    yaml_parser_t parser;
    yaml_document_t document;
    int line = 1;

    if (!yaml_parser_initialize(&parser))
        return line;
    yaml_parser_set_input_string(&parser, text, n_bytes);
    if (yaml_parser_load(&parser, &document)) {
        line = line_in(&document, list, item, field);
        yaml_document_delete(&document);
    }
    yaml_parser_delete(&parser);
    return line;
}
