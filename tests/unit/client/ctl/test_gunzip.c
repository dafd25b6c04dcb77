/* SPDX-License-Identifier: MIT */
/* test_gunzip - a packed file piece by piece, and whole where it is small: much that is unpacked takes no memory. */
#include "client/ctl/gunzip.h"

#include <stdlib.h>
#include <zlib.h>

#include "tests/lib/test.h"

static uint8_t gz[1 << 20];
static size_t gz_n;

static struct {
    uint64_t n, pieces, stop_at;
    size_t largest;
    uint32_t sum;
} taken;

static bool take(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx;
    CHECK(n > 0);
    taken.n += n;
    taken.largest = n > taken.largest ? n : taken.largest;
    taken.sum = (uint32_t)crc32(taken.sum, bytes, (uInt)n);
    return ++taken.pieces != taken.stop_at;
}

/* A member of n bytes, all alike but for the first million. Its sum goes on from `sum`. */
static uint32_t pack(uint64_t n, uint32_t sum)
{
    static uint8_t piece[1000000];
    z_stream z = {0};
    CHECK_INT(deflateInit2(&z, 1, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    z.next_out = gz + gz_n;
    z.avail_out = (uInt)(sizeof gz - gz_n);
    for (size_t i = 0; i < sizeof piece; i++)
        piece[i] = (uint8_t)(i / 100);
    while (n > 0) {
        z.next_in = piece;
        z.avail_in = (uInt)(n < sizeof piece ? n : sizeof piece);
        n -= z.avail_in;
        sum = (uint32_t)crc32(sum, piece, z.avail_in);
        CHECK_INT(deflate(&z, n == 0 ? Z_FINISH : Z_NO_FLUSH), n == 0 ? Z_STREAM_END : Z_OK);
        memset(piece, 0, sizeof piece);
    }
    gz_n = sizeof gz - z.avail_out;
    deflateEnd(&z);
    return sum;
}

static struct unpacked in_pieces(uint64_t stop_at)
{
    struct unpacked unpacked;
    struct fault fault;
    memset(&taken, 0, sizeof taken);
    taken.stop_at = stop_at;
    CHECK(gunzip_pieces(gz, gz_n, take, NULL, &unpacked, &fault));
    return unpacked;
}

TEST(all_members_come_in_pieces_of_bounded_size)
{
    static const uint64_t sizes[] = {1, GUNZIP_PIECE, 3 * GUNZIP_PIECE, 5000000};
    uint64_t n = 0;
    uint32_t sum = 0;
    gz_n = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        sum = pack(sizes[i], sum);
        n += sizes[i];
        const struct unpacked u = in_pieces(0);
        CHECK(!u.damaged && !u.stopped && u.lost == 0 && u.p == NULL);
        CHECK_INT(u.n, n);
        CHECK_INT(taken.n, n);
        CHECK_INT(taken.sum, sum);
        CHECK(taken.largest <= GUNZIP_PIECE);
    }
}

TEST(who_takes_the_pieces_may_stop)
{
    gz_n = 0;
    pack(5000000, 0);
    pack(5000000, 0);
    const struct unpacked u = in_pieces(2);
    CHECK(u.stopped && !u.damaged);
    CHECK_INT(taken.pieces, 2);
}

TEST(the_whole_is_refused_where_it_is_large)
{
    struct unpacked u;
    struct fault fault;
    gz_n = 0;
    const uint32_t sum = pack(GUNZIP_WHOLE_MAX, 0);
    CHECK(gunzip(gz, gz_n, &u, &fault));
    CHECK_INT(u.n, GUNZIP_WHOLE_MAX);
    CHECK(u.p && (uint32_t)crc32(0, u.p, (uInt)u.n) == sum);
    free(u.p);
    pack(1, 0);
    CHECK(!gunzip(gz, gz_n, &u, &fault));
    CHECK(!u.p && strstr(fault.text, "more than 64 MiB: unpack it with gunzip"));
    CHECK_INT(in_pieces(0).n, GUNZIP_WHOLE_MAX + 1);
}

TEST(of_a_damaged_member_comes_what_is_before_the_damage)
{
    gz_n = 0;
    pack(3000000, 0);
    const size_t first = gz_n;
    pack(1000, 0);
    memset(gz + first / 2, 0xff, 8);
    const struct unpacked u = in_pieces(0);
    CHECK(u.damaged && u.n >= 1000);
    CHECK_INT(taken.n, u.n);
    gz_n = first / 2;
    CHECK(in_pieces(0).damaged);
}

/* As gzip itself takes it. */
TEST(zeros_behind_a_member_are_no_loss)
{
    gz_n = 0;
    pack(1000, 0);
    memset(gz + gz_n, 0, 100000);
    gz_n += 100000;
    pack(1000, 0);
    memset(gz + gz_n, 0, 100000);
    gz_n += 100000;
    const struct unpacked u = in_pieces(0);
    CHECK(!u.damaged && u.lost == 0 && u.n == 2000);
    gz[gz_n++] = 1;
    CHECK_INT(in_pieces(0).lost, 1);
}

int main(void)
{
    RUN(all_members_come_in_pieces_of_bounded_size);
    RUN(who_takes_the_pieces_may_stop);
    RUN(the_whole_is_refused_where_it_is_large);
    RUN(of_a_damaged_member_comes_what_is_before_the_damage);
    RUN(zeros_behind_a_member_are_no_loss);
    return test_end();
}
