#include "host.h"
#include <isocoat/isocoat.hpp>

int main(int argc, char **argv) { return run_host(argc, argv); }
