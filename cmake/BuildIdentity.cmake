# Writes build_identity.cpp: who built this program from what. Run by cmake -P with SOURCES (the project's folder), OUTPUT,
# VERSION and COMPILER. The identity covers the contents of everything that can change a result or what crosses the wire,
# the compiler and its version; not paths, times or machines: the same sources and compiler give the same identity anywhere.
set(patterns "")
foreach(folder core services idl)
  foreach(ending cpp hpp h c S proto idl txt)
    list(APPEND patterns "${SOURCES}/${folder}/*.${ending}")
  endforeach()
endforeach()
file(GLOB_RECURSE files RELATIVE ${SOURCES} ${patterns})
list(APPEND files cmake/KilotwinTargets.cmake)
list(SORT files)
set(contents "${COMPILER}")
foreach(file ${files})
  file(SHA256 "${SOURCES}/${file}" hash)
  string(APPEND contents "\n${hash} ${file}")
endforeach()
string(SHA256 identity "${contents}")
string(SUBSTRING "${identity}" 0 16 identity)
file(WRITE "${OUTPUT}"
  "// Written by cmake/BuildIdentity.cmake.\n#include \"core/base/build_identity.hpp\"\n\nnamespace kilotwin {\n"
  "std::string_view build_identity() { return \"${VERSION}-${identity}\"; }\n"
  "std::string_view build_compiler() { return \"${COMPILER}\"; }\n}  // namespace kilotwin\n")
