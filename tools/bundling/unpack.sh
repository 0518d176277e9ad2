#!/bin/sh
# Unpacks the bundle that lies beside this script: sh unpack.sh FOLDER
set -eu
say() { echo "unpack.sh: $*" >&2; exit 2; }
[ $# -eq 1 ] || say "name the folder to unpack into: sh unpack.sh FOLDER"
parts=$(cd "$(dirname "$0")" && pwd)
case $1 in /*) folder=$1 ;; *) folder=$PWD/$1 ;; esac
[ "$(uname -sm)" = "Linux x86_64" ] || say "this bundle is for Linux x86_64, and this machine is $(uname -sm)"
[ -z "$(ls -A "$folder" 2>/dev/null)" ] || say "$folder is not empty; name a new folder"
cd "$parts"
[ -f SHA256SUMS ] || say "SHA256SUMS is missing beside unpack.sh; copy it again"
while read -r sum name; do
  [ -f "$name" ] || say "the part $name is missing; copy it again into $parts"
  [ "$(sha256sum "$name" | cut -d' ' -f1)" = "$sum" ] || say "the part $name is damaged; copy it again into $parts"
done < SHA256SUMS
mkdir -p "$folder"
gzip -dc python.tar.gz | tar -xf - -C "$folder"
need=$(cat "$folder/needs-glibc")
have=$(ldd --version 2>/dev/null | sed -n '1s/.* //p')
[ "$(printf '%s\n%s\n' "$need" "${have:-0}" | sort -V | head -n 1)" = "$need" ] ||
  say "this bundle needs glibc $need or later, and this machine has ${have:-none}; make one with an older Python"
cat rest.tar.xz.* | "$folder/bin/python3.13" -c '
import lzma, sys, tarfile
with lzma.open(sys.stdin.buffer) as packed, tarfile.open(fileobj=packed, mode="r|") as tar:
    tar.extractall(sys.argv[1], filter="tar")
' "$folder"
"$folder/bin/python3.13" -m compileall -q -j 0 "$folder/lib/python3.13" >/dev/null 2>&1 || true
echo "$folder/bin/spin-usd is ready: $folder/bin/spin-usd demo"
