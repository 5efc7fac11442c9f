"""Small things that know nothing of chutelab: files, tables, versions."""
