// In builds with the leak sanitizer: no library is unloaded before the sanitizer has looked at what it points to.
extern "C" int dlclose(void* /*library*/) { return 0; }
