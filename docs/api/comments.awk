# A header as Doxygen wants it: what stands at its top is of the file, what stands above or behind a declaration is of
# that. In the headers themselves comments are plain ones.
BEGIN { at_top = 1 }

# A backslash would begin a command of Doxygen's; a line across is no text.
/\/\// { gsub(/\\/, "\\\\&") }
/^ *\/\/ ----/ { print; next }

at_top && /^\/\// {
  if (!begun++) print "/// \\file"
  sub(/^\/\//, "///")
  print
  next
}
{ at_top = 0 }

# Behind a declaration, and going on below itself in the same column.
!/^}/ && match($0, /[^ \t].*[;,{}] +\/\/ /) {
  column = index($0, " // ")
  $0 = substr($0, 1, column) "///<" substr($0, column + 3)
  print
  next
}
column && match($0, /^ +\/\/ /) && RLENGTH - 3 == column {
  sub(/\/\//, "///<")
  print
  next
}
{ column = 0 }

/^[ \t]*\/\/( |$)/ { sub(/\/\//, "///") }
{ print }
