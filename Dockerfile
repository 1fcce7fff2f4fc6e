# Everything that `make test` and `snakemake` need, with rendering on Mesa in software or on a GPU.
#   docker build --tag synfeal .
#   docker build --tag synfeal-cuda --build-arg LOCK=requirements-cuda.lock .
# docs/containers.md says how to run it.
FROM debian:bookworm-slim
ARG LOCK=requirements.lock
ENV LANG=C.UTF-8 NVIDIA_DRIVER_CAPABILITIES=compute,graphics,utility
WORKDIR /synfeal
COPY setup/container.sh setup/system_packages.sh setup/
RUN setup/container.sh
COPY . .
RUN make LOCK=$LOCK .venv/installed compile && rm -rf /root/.cache
ENV PATH=/synfeal/.venv/bin:$PATH PYTHONHASHSEED=0
CMD ["make", "help"]
