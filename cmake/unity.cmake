# Several files compiled as one, for who builds everything at once: headers are read and templates made once for all of
# them. Whoever works on a file leaves it off: a change of one would compile its neighbours too.
#   cairn_unity(TARGET SIZE)    with CAIRN_UNITY=ON, SIZE files of TARGET at a time
# What two files of a target name alike in their anonymous namespaces is defined twice then: name it otherwise, put it
# into a header that both include, or leave one out by SKIP_UNITY_BUILD_INCLUSION. Files with compile options of their
# own are left out anyway.
option(CAIRN_UNITY "Compile several files at a time (the preset ci)" OFF)

function(cairn_unity target size)
    if(CAIRN_UNITY)
        set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${size})
    endif()
endfunction()
