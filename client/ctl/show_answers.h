/* SPDX-License-Identifier: MIT */
/*
 * show_answers - what the daemon answers about moving, the nearest obstacle, its sonars, and what an answer rests on:
 * for people. Each takes the result of the method of its name.
 */
#ifndef SONARD_SHOW_ANSWERS_H
#define SONARD_SHOW_ANSWERS_H

#include "page.h"

void show_nearest(const struct page *page, const json_t *result);
void show_limit(const struct page *page, const json_t *result);
void show_collision(const struct page *page, const json_t *result); /* time_to_collision */
void show_sensors(const struct page *page, const json_t *result);
void show_plan(const struct page *page, const json_t *result);
void show_explain(const struct page *page, const json_t *result);

#endif
