/* SPDX-License-Identifier: MIT */
#include "image.h"

static uint8_t loudest(const struct ping *ping, uint16_t beam, uint32_t from, uint32_t to)
{
    size_t base = (size_t)beam * ping->n_bins;
    unsigned most = 0;
    for (uint32_t i = from; i < to; i++) {
        unsigned v = ping->sample_bytes == 1 ? ((const uint8_t *)ping->samples)[base + i]
                                             : (unsigned)((const uint16_t *)ping->samples)[base + i] >> 8;
        most = v > most ? v : most;
    }
    return (uint8_t)most;
}

static void fill(struct image_row *row, const struct ping *ping, const struct echoes *echoes, uint16_t beam)
{
    const struct beam_echoes *heard = &echoes->beam[beam];
    uint32_t n = ping->kind == PING_PROFILE ? ping->n_bins : 0;
    *row = (struct image_row){.t_ns = ping->t_ns,
                              .az_rad = heard->az_rad,
                              .width_rad = ping->az_aperture_rad,
                              .r0_m = ping->r0_m,
                              .r1_m = ping->r0_m + (float)n * ping->dr_m,
                              .n_bins = (uint16_t)(n < IMAGE_BINS ? n : IMAGE_BINS),
                              .blind_m = heard->blind_m,
                              .state = heard->state};
    for (uint32_t i = 0; i < row->n_bins; i++)
        row->bin[i] = loudest(ping, beam, (uint32_t)((uint64_t)i * n / row->n_bins),
                              (uint32_t)((uint64_t)(i + 1) * n / row->n_bins));
    row->n_echoes = heard->n;
    row->near_m = heard->echo[0].near_m;
    for (int i = 0; i < heard->n; i++) {
        row->echo_m[i] = heard->echo[i].range_m;
        row->confidence[i] = heard->echo[i].confidence;
        row->flags[i] = heard->echo[i].flags;
    }
}

/* Is the first echo the vehicle's own, as is known here, after the marks, and does the free interval end with it? What
 * is in its first cell may begin half a pulse earlier still. */
static bool ends_with_own(const struct beam_echoes *heard)
{
    const struct echo *first = &heard->echo[0];
    return heard->n > 0 && (first->flags & ECHO_OWN) &&
           heard->free_to_m >= first->near_m - 2 * (first->range_m - first->near_m);
}

static struct image_end end_of(const struct echoes *echoes, uint16_t beam)
{
    static const enum image_hides words[] = {[BEAM_HIDES_NOTHING] = IMAGE_HIDES_NOTHING,
                                             [BEAM_HIDES_MASK] = IMAGE_HIDES_MASK,
                                             [BEAM_HIDES_BEFORE] = IMAGE_HIDES_BEFORE,
                                             [BEAM_HIDES_RING] = IMAGE_HIDES_RING,
                                             [BEAM_HIDES_DEAF] = IMAGE_HIDES_DEAF};
    const struct beam_echoes *heard = &echoes->beam[beam];
    const enum image_hides hides = ends_with_own(heard) ? IMAGE_HIDES_OWN : words[heard->hides];
    const float at_m = hides == IMAGE_HIDES_BEFORE ? heard->blind_m : heard->free_to_m;
    struct image_end end = {.ned = (echoes->pose.has & POSE_ATTITUDE) != 0,
                            .az_rad = heard->az_rad,
                            .el_rad = heard->el_rad,
                            .half_az_rad = echoes->az_aperture_rad / 2,
                            .half_el_rad = echoes->el_aperture_rad / 2,
                            .at_m = at_m > 0 ? at_m : 0,
                            .hides = (uint16_t)hides};
    for (int i = 0; i < 4; i++)
        end.attitude[i] = (float)echoes->pose.attitude[i];
    return end;
}

void image_enter(struct image *image, const struct ping *ping, const struct echoes *echoes)
{
    for (uint16_t beam = 0; beam < echoes->n_beams; beam++) {
        uint32_t index = beam;
        if (ping->head_turn)
            index =
                ping->head_turn <= IMAGE_ROWS
                    ? ping->head_units % ping->head_turn
                    : (uint32_t)((uint64_t)(ping->head_units % ping->head_turn) * IMAGE_ROWS / ping->head_turn);
        struct image_row row;
        const struct image_end end = end_of(echoes, beam);
        snapshot_publish(&image->end[index], &end);
        fill(&row, ping, echoes, beam);
        snapshot_publish(&image->row[index], &row);
    }
}

void image_end(struct image *image, uint32_t index, struct image_end *end)
{
    snapshot_read(&image->end[index], end);
}

void image_row(struct image *image, uint32_t index, struct image_row *row)
{
    snapshot_read(&image->row[index], row);
}
