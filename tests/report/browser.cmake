# The page of squint report in headless Chromium: ctest -L browser.  Skipped, with a word why, where node, Chromium or
# playwright-core (npm ci in tools/report) are missing.
find_program(NODE node)
if(NODE)
  set(browser_test ${NODE} ${CMAKE_CURRENT_LIST_DIR}/browser_test.mjs $<TARGET_FILE:squint>)
else()
  set(browser_test sh -c "echo 'Skipped: node is not installed'; exit 77")
endif()
add_test(NAME Report.ThePageWorksInABrowser COMMAND ${browser_test})
set_tests_properties(Report.ThePageWorksInABrowser PROPERTIES LABELS browser TIMEOUT 600 SKIP_RETURN_CODE 77)
