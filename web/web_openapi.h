/* SPDX-License-Identifier: MIT */
/* web_openapi - the HTTP API as an OpenAPI 3.1 document, from the tables of methods and shapes (protocol/). */
#ifndef SONARD_WEB_OPENAPI_H
#define SONARD_WEB_OPENAPI_H

/** web_openapi - the document as JSON text, for free(); NULL: no memory. */
char *web_openapi(void);

#endif
