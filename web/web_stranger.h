/* SPDX-License-Identifier: MIT */
/* web_stranger - the page for a person whose browser used a name that this server does not answer to. Pure. */
#ifndef SONARD_WEB_STRANGER_H
#define SONARD_WEB_STRANGER_H

/**
 * web_stranger_page - HTML that says what to type instead. host: as the browser sent it, of any bytes; NULL or empty:
 * none. here: the address and port that the browser reached, as 192.0.2.1:9360 or [::1]:9360. For free(); NULL: no
 * memory.
 */
char *web_stranger_page(const char *host, const char *here);

#endif
