/* SPDX-License-Identifier: MIT */
/* test_page - page.h: what stands in the cells of a table. */
#include "client/ctl/page.h"

#include <math.h>

#include "tests/lib/test.h"

/* A recording without a date counts from 0, and may be shorter than a second; 0 and NAN are no time. */
TEST(the_first_second_is_a_time)
{
    char cell[PAGE_CELL];
    CHECK_STR(page_utc(cell, 0.9), "1970-01-01 00:00:00 UTC");
    CHECK_STR(page_utc(cell, 4.2), "1970-01-01 00:00:04 UTC");
    CHECK_STR(page_utc(cell, 0), "-");
    CHECK_STR(page_utc(cell, NAN), "-");
}

int main(void)
{
    RUN(the_first_second_is_a_time);
    return test_end();
}
