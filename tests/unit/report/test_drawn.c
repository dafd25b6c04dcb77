/* SPDX-License-Identifier: MIT */
/*
 * test_drawn - the generator of waters that detectors are judged by: what it says would be heard stands out of its
 * samples as often as it says, and what it says is background does not. No detector is asked.
 */
#include "report/lib/drawn_sound.h"
#include "tests/lib/test.h"
#include "tests/sound/sound.h"

static struct drawn_sound sound, other;

TEST(same_seed_same_bytes)
{
    for (unsigned n = 0; n < 4; n++) {
        drawn_sound_begin(&sound, 7, n);
        drawn_sound_begin(&other, 7, n);
        while (drawn_sound_next(&sound)) {
            CHECK(drawn_sound_next(&other));
            CHECK(memcmp(sound.samples, other.samples, (size_t)sound.ping.n_beams * sound.ping.n_bins) == 0);
            if (test_case_failed)
                return;
        }
    }
}

TEST(counts_and_powers_belong_together)
{
    for (unsigned n = 0; n < 40; n++) {
        const struct drawn_world w = drawn_world_of(3, n);
        for (double db = -90.0; db < 5.0; db += 0.37) {
            const double power = sound_power(db);
            const uint8_t count = drawn_count(&w, power);
            const double above = drawn_power_above(&w, count);
            CHECK(above > power);
            if (isfinite(above)) {
                CHECK(drawn_count(&w, above * 1.0001) > count);
                CHECK(drawn_count(&w, above * 0.9999) == count);
            }
        }
    }
}

/* Against 400 000 draws. */
TEST(power_of_a_constant_in_speckle)
{
    static const double coherent[] = {0.0, 0.5, 3.0, 20.0, 400.0};
    struct dice dice = dice_of(5, 5);
    for (size_t i = 0; i < sizeof coherent / sizeof coherent[0]; i++) {
        const double x = 0.5 * (coherent[i] + 1.0);
        int below = 0;
        for (int n = 0; n < 400000; n++)
            below += sound_intensity(sqrt(coherent[i]) + dice_normal(&dice)) <= x;
        CHECK_NEAR(below / 400000.0, hearable_below(coherent[i], 1.0, x), 0.02, 1e-3);
    }
    CHECK_NEAR(hearable_below(0.0, 2.0, 3.0), -expm1(-1.5), 1e-9, 0);
}

/* Worlds in which each ping is what its mean powers say: nothing but what the truth knows of. */
static bool is_plain(const struct drawn_world *w)
{
    return w->beams == 1 && w->texture == 0 && w->raised_share <= 0.0 && w->dead_share <= 0.0 && w->others == 0;
}

/* Does target t exceed, in any cell of it, what the background there hardly ever does? */
static bool stands_out(unsigned t)
{
    const struct insonified *b = &sound.beam;
    const uint32_t p = sound.world.pulse_bins;
    const bool glints = b->glint[t].power > 0.0;
    const uint32_t begin = glints && b->glint[t].bin < b->first[t] ? b->glint[t].bin : b->first[t];
    const uint32_t end = glints && b->glint[t].bin >= b->end[t] ? b->glint[t].bin + 1 : b->end[t];
    for (uint32_t i = begin; i < end + p && i < sound.world.bins; i++) {
        const double over = hearable_background_at(&sound.insonify, &sound.margins, b, i, 1.0).over;
        if (isfinite(over) && sound.samples[0][i] >= drawn_count(&sound.world, over * 1.0001))
            return true;
    }
    return false;
}

TEST(heard_targets_stand_out_of_the_samples)
{
    int heard[DRAWN_CLASSES] = {0}, out[DRAWN_CLASSES] = {0};
    for (uint64_t seed = 1; seed <= 6; seed++)
        for (unsigned n = 0; n < 36; n++) {
            const struct drawn_world w = drawn_world_of(seed, n);
            if (!is_plain(&w))
                continue;
            drawn_sound_begin(&sound, seed, n);
            while (drawn_sound_next(&sound))
                for (unsigned t = 0; t < w.targets; t++)
                    if (isfinite(sound.truth[0].hearable.by_m[t])) {
                        heard[w.target[t].class]++;
                        out[w.target[t].class] += stands_out(t);
                    }
        }
    for (int c = 0; c < DRAWN_CLASSES; c++) {
        printf("# %s: heard in %d beams, stands out in %.2f %%\n", drawn_class_name[c], heard[c],
               100.0 * out[c] / fmax(heard[c], 1));
        CHECK(out[c] >= 0.98 * heard[c]);
    }
    CHECK(heard[DRAWN_WALL] > 1000 && heard[DRAWN_NET] > 100 && heard[DRAWN_PILE] + heard[DRAWN_LINE] > 20);
}

/* Beams with nothing in them, one cell a pulse: how often the background exceeds what it hardly ever exceeds. */
TEST(background_does_not)
{
    uint64_t cells = 0, exceed = 0;
    for (uint64_t seed = 1; seed <= 6; seed++)
        for (unsigned n = 0; n < 36; n++) {
            const struct drawn_world w = drawn_world_of(seed, n);
            if (!is_plain(&w) || w.targets > 0 || w.planes > 0 || w.frame || w.stray_share > 0.0)
                continue;
            drawn_sound_begin(&sound, seed, n);
            while (drawn_sound_next(&sound))
                for (uint32_t i = (uint32_t)(1.2 * w.ring_m / sound.insonify.bin_m); i < w.bins;
                     i += w.pulse_bins) {
                    const double over =
                        hearable_background_at(&sound.insonify, &sound.margins, &sound.beam, i, 1.0).over;
                    cells++;
                    exceed += isfinite(over) && sound.samples[0][i] >= drawn_count(&w, over * 1.0001);
                }
        }
    printf("# background: %.2g of %llu cells exceed what one of 1e4 may\n", (double)exceed / (double)cells,
           (unsigned long long)cells);
    CHECK(cells > 100000 && (double)exceed <= 2e-4 * (double)cells);
}

int main(void)
{
    RUN(same_seed_same_bytes);
    RUN(counts_and_powers_belong_together);
    RUN(power_of_a_constant_in_speckle);
    RUN(heard_targets_stand_out_of_the_samples);
    RUN(background_does_not);
    return test_end();
}
