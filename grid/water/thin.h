/* SPDX-License-Identifier: MIT */
/*
 * thin - which record of a fan says nothing that those before and behind it do not say: a fan pings so often that most
 * of them are alike.
 */
#ifndef SONARD_WATER_THIN_H
#define SONARD_WATER_THIN_H

#include "record.h"

/**
 * thin_spares - is `middle` spared by the one before it and the newest? They are of the same size, sent from nearly the
 * same place and with nearly the same axes, and each end of it at an echo is seen by both. Cost: columns of the image
 * times log of them.
 */
bool thin_spares(const struct water_record *before, const struct water_record *middle,
                 const struct water_record *newest);

#endif
