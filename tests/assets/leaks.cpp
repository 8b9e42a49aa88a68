// assimp 5.2.5 loses memory when it refuses an STL file; a leak check is to report ours only.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libassimp\n";
}
