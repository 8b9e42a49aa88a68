// assimp 5.2.5 loses memory when it refuses an STL file; a leak check is to report ours only.
// NOLINTBEGIN(readability-identifier-naming): the name by which the sanitizer asks
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libassimp\n";
}
// NOLINTEND(readability-identifier-naming)
